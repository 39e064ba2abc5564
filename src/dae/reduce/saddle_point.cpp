#include "dae/reduce/saddle_point.hpp"

#include <algorithm>
#include <map>

#include "base/error.hpp"
#include "dae/rank/definite.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::dae {
namespace {

/// The entries of [M B; C D] as residues modulo a large prime.
class Numbers {
 public:
  Numbers(const std::vector<Entry>& A, int first) : first_(first) {
    std::vector<Expr> values;
    for (const Entry& e : A) values.push_back(e.value);
    const std::vector<generic::Residue> numbers = generic::residues(values);
    for (std::size_t k = 0; k < A.size(); ++k) at_[{A[k].row, A[k].column}] = numbers[k];
  }

  /// The sign with which row i equals column i, left of D; 0 if neither does.
  int sign_of_row(int i) const {
    int sign = 0;
    for (int j = 0; j < first_; ++j) {
      const generic::Residue here = at(i, j), there = at(j, i);
      if (here.is_zero() && there.is_zero()) continue;
      const int now = (here - there).is_zero() ? 1 : (here + there).is_zero() ? -1 : 0;
      if (now == 0 || (sign != 0 && now != sign)) return 0;
      sign = now;
    }
    return sign == 0 ? 1 : sign;
  }
  bool are_equal(int i, int j, int sign) const {
    return sign > 0 ? (at(i, j) - at(j, i)).is_zero() : (at(i, j) + at(j, i)).is_zero();
  }

 private:
  generic::Residue at(int i, int j) const {
    const auto found = at_.find({i, j});
    return found == at_.end() ? generic::Residue{} : found->second;
  }
  int first_;
  std::map<std::pair<int, int>, generic::Residue> at_;
};

/// Signs of the rows with which A is symmetric, M positive definite and the diagonal of D negative; empty if
/// there are none.
std::optional<std::vector<int>> signs_of_rows(const std::vector<Entry>& A, int n, int first,
                                              const std::unordered_map<Expr, double>& parameters) {
  // If M - δ diag M is definite, every pivot of M exceeds δ times its diagonal entry.
  const Expr rest = Expr(1) - Expr(1) / Expr(1000);
  std::vector<Entry> M;
  for (const Entry& e : A)
    if (e.row < first && e.column < first)
      M.push_back({e.row, e.column, e.row == e.column ? rest * e.value : e.value});
  const int sign = definite_sign(first, M, parameters);
  if (sign == 0) return std::nullopt;
  std::vector<int> signs(static_cast<std::size_t>(n), sign);
  try {
    const Numbers numbers(A, first);
    for (int i = first; i < n; ++i) {
      const int own = numbers.sign_of_row(i);
      if (own == 0) return std::nullopt;
      signs[i] *= own;
    }
    for (const Entry& e : A)
      if (e.row >= first && e.column >= first &&
          (!numbers.are_equal(e.row, e.column, signs[e.row] * signs[e.column]) ||
           (e.row == e.column && definite_sign(1, {{0, 0, Expr(signs[e.row]) * e.value}}, parameters) >= 0)))
        return std::nullopt;
  } catch (const Error&) {  // a divisor that vanishes identically
    return std::nullopt;
  }
  return signs;
}

}  // namespace

std::optional<VecX> saddle_point_solution(const std::vector<Entry>& A, const VecX& b, int multipliers,
                                          const std::unordered_map<Expr, double>& parameters) {
  const int n = static_cast<int>(b.size()), first = n - multipliers;
  if (multipliers == 0 || first == 0) return std::nullopt;
  std::vector<Entry> entries;
  std::copy_if(A.begin(), A.end(), std::back_inserter(entries),
               [](const Entry& e) { return !e.value.is_zero(); });
  const auto signs = signs_of_rows(entries, n, first, parameters);
  if (!signs) return std::nullopt;
  VecX right = b;
  for (Entry& e : entries)
    if ((*signs)[e.row] < 0) e.value = -e.value;
  for (int i = 0; i < n; ++i)
    if ((*signs)[i] < 0) right[i] = -right[i];
  return saddle_solution(entries, right, first);
}

}  // namespace pendula::dae
