#include "dae/rank/definite.hpp"

#include <Eigen/SparseCholesky>

#include <cmath>
#include <map>

#include "base/error.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/declaration.hpp"

namespace pendula::dae {
namespace {

bool is_symmetric(const std::vector<Entry>& entries, std::span<const Expr> values) {
  std::vector<generic::Residue> numbers;
  try {
    numbers = generic::residues(values);
  } catch (const Error&) {
    return false;
  }
  std::map<std::pair<int, int>, std::uint64_t> at;
  for (std::size_t k = 0; k < entries.size(); ++k) at[{entries[k].row, entries[k].column}] = numbers[k].value;
  for (const auto& [place, value] : at) {
    const auto mirror = at.find({place.second, place.first});
    if ((mirror == at.end() ? 0 : mirror->second) != value) return false;
  }
  return true;
}

/// A reproducible point between ½ and 2 in every symbol.
std::unordered_map<Expr, double> point(std::span<const Expr> symbols,
                                       const std::unordered_map<Expr, double>& parameters, int attempt) {
  std::unordered_map<Expr, double> values;
  for (Expr leaf : symbols) {
    const auto known = parameters.find(leaf);
    const std::uint64_t who = name_hash(leaf);
    const double phase = std::sin(12.9898 * static_cast<double>(who % 9973) + 78.233 * attempt) * 43758.5453;
    const double drawn = 0.5 + 1.5 * (phase - std::floor(phase));
    const bool negative = attempt % 2 == 1 && who % 3 == 0 && symbol_of(leaf).kind == Kind::variable;
    values[leaf] = known != parameters.end() ? known->second : negative ? -drawn : drawn;
  }
  return values;
}

/// 1: positive definite, -1: negative definite, 0: neither.
int sign_at(int n, const std::vector<Entry>& entries, const std::vector<double>& numbers) {
  std::vector<Eigen::Triplet<double>> list;
  double diagonal = 0;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    if (!std::isfinite(numbers[k])) return 0;
    list.emplace_back(entries[k].row, entries[k].column, numbers[k]);
    if (entries[k].row == entries[k].column) diagonal += numbers[k];
  }
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(list.begin(), list.end());
  const int sign = diagonal > 0 ? 1 : -1;
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> cholesky(sign * A);
  return cholesky.info() == Eigen::Success ? sign : 0;
}

}  // namespace

bool is_definite(int n, const std::vector<Entry>& entries,
                 const std::unordered_map<Expr, double>& parameters) {
  return definite_sign(n, entries, parameters) != 0;
}

int definite_sign(int n, const std::vector<Entry>& entries,
                  const std::unordered_map<Expr, double>& parameters) {
  std::vector<Expr> values;
  for (const Entry& e : entries) values.push_back(e.value);
  if (!is_symmetric(entries, values)) return 0;
  const std::vector<Expr> symbols = leaves(values);
  int sign = 0;
  for (int attempt = 0; attempt < 4; ++attempt) {
    const int now = sign_at(n, entries, evaluate(values, point(symbols, parameters, attempt)));
    if (now == 0 || (sign != 0 && now != sign)) return 0;
    sign = now;
  }
  return sign;
}

}  // namespace pendula::dae
