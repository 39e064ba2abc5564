#include "dae/rank/rank.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "base/decompositions.hpp"
#include "dae/rank/magnitudes.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {
namespace {

constexpr double rank_tolerance =
    1e-9;  // relative to σ₁: far above rounding (1e-15·n), far below deliberate values

}  // namespace

std::unordered_map<Expr, double> random_point(std::span<const Expr> outputs, int attempt) {
  std::unordered_map<Expr, double> point;
  std::uint64_t calls = 0;  // different arguments of one function give different values
  for (Expr node : topological(outputs)) {
    const bool named_constant = node.is_symbol() && symbol_of(node).kind == Kind::constant;
    if ((!node.is_symbol() || named_constant) && node.op() != Op::call) continue;
    const std::uint64_t who = name_hash(node) + (node.is_symbol() ? 0 : ++calls);
    std::mt19937_64 random(who * 31 + static_cast<unsigned>(attempt));
    point[node] = std::uniform_real_distribution<double>(0.5, 1.5)(random);
  }
  return point;
}

Mat evaluate(const MatX& m, const std::unordered_map<Expr, double>& values) {
  const auto v = pendula::evaluate(entries(m), values);
  return Eigen::Map<const Mat>(v.data(), m.rows(), m.cols());
}

int numeric_rank(const Mat& m, double* gap) {
  if (m.size() == 0) return 0;
  const Eigen::JacobiSVD<Mat> svd(equilibrated(m));
  const Vec s = svd.singularValues();
  int rank = 0;
  while (rank < s.size() && s[rank] > rank_tolerance * s[0] && s[rank] > 0) ++rank;
  if (gap) *gap = rank ? s[rank - 1] / s[0] : 0;
  return rank;
}

/// The rank at a point, independent of units. Singular values count if they clearly exceed the effect of the
/// last digits of the point. Entries that have cancelled are set to 0; then factors r_i c_j are removed
/// (balance()).
class RankInOwnUnits {
 public:
  RankInOwnUnits(const MatX& m, const std::unordered_map<Expr, double>& point) : value_(m.rows(), m.cols()) {
    std::vector<Expr> leaves;
    std::vector<double> place;
    for (const auto& [node, value] : point) {
      leaves.push_back(node);
      place.push_back(value);
    }
    const Evaluator at(entries(m), leaves);
    const auto matrix = [&](const std::vector<double>& where) -> Mat {
      const std::vector<double> v = at(where);
      return Eigen::Map<const Mat>(v.data(), m.rows(), m.cols());
    };
    value_ = matrix(place);
    noise_ = Mat::Zero(m.rows(), m.cols());
    constexpr double last_digits = 4e-16;   // 1 ± this rounds to 1 ± 2 ε
    for (std::size_t k = 1; k <= 8; ++k) {  // a single perturbation may happen to round alike
      std::vector<double> moved = place;
      for (std::size_t j = 0; j < moved.size(); ++j)
        moved[j] *= 1 + ((j * k / 3) % 2 == 0 ? last_digits : -last_digits);
      noise_ = noise_.cwiseMax((matrix(moved) - value_).cwiseAbs());
    }
    constexpr double clear = 10;  // times the noise
    value_ = (value_.array().abs() > clear * noise_.array()).select(value_, 0);
  }

  int rank() {
    const Balance units = balance(value_);
    value_ = units(value_);
    noise_ = units(noise_);
    if (!value_.allFinite() || !noise_.allFinite()) return 0;
    constexpr double clear = 10;  // times the noise
    const Vec s = Eigen::JacobiSVD<Mat>(value_).singularValues();
    const double least = clear * (noise_.norm() + std::numeric_limits<double>::epsilon() * s[0]);
    return static_cast<int>((s.array() > least).count());
  }

 private:
  Mat value_, noise_;
};

using Sizes = std::unordered_map<Expr, double>;

/// The sizes of all symbols for which the terms of every sum are alike (magnitudes.hpp): where a length is
/// 10⁹, (d - 10⁹)/d has no digits of d left at d = 1.
static Sizes sizes_in(const std::vector<Expr>& rows) {
  std::vector<Expr> symbols;
  for (Expr leaf : leaves(rows))
    if (symbol_of(leaf).kind != Kind::constant) symbols.push_back(leaf);
  const Vec size = magnitudes(rows, rows.size(), symbols, {}, {}).unknowns;
  Sizes of;
  for (std::size_t k = 0; k < symbols.size(); ++k) of[symbols[k]] = size[k];
  return of;
}

/// Raises `best` to the largest numeric rank at a few random points near these sizes, 1 where there is none.
static void sample_rank(const MatX& m, const Sizes& sizes, std::optional<int>& best) {
  for (int attempt = 0, valid = 0; attempt < 20 && valid < 6; ++attempt) {
    auto point = random_point(entries(m), attempt);
    for (const auto& [leaf, size] : sizes)
      if (const auto at = point.find(leaf); at != point.end()) at->second *= size;
    const Mat value = evaluate(m, point);
    if (!value.allFinite()) continue;
    ++valid;
    int rank = numeric_rank(value);
    if (rank < std::min(m.rows(), m.cols())) rank = std::max(rank, RankInOwnUnits(m, point).rank());
    best = std::max(best.value_or(0), rank);
    if (best == std::min(m.rows(), m.cols())) break;
  }
}

/// The rank at random points, which detects identities between transcendental functions. Empty if the entries
/// are not finite at any of them.
static std::optional<int> sampled_rank(const MatX& m, const std::vector<Expr>& equations) {
  std::optional<int> best;
  sample_rank(m, {}, best);
  if (best == std::min(m.rows(), m.cols())) return best;
  const std::span<const Expr> own = entries(m);
  sample_rank(m, sizes_in(equations.empty() ? std::vector<Expr>(own.begin(), own.end()) : equations), best);
  return best;
}

ModularRank generic_rank(std::span<const Entry> entries, int rows, int columns,
                         const std::vector<Expr>& equations) {
  ModularRank exact = modular_rank(entries, rows, columns);
  constexpr int affordable = 64;  // singular values cost O(n³)
  std::vector<Expr> values;
  for (const Entry& e : entries) values.push_back(e.value);
  if (std::max(rows, columns) > affordable || exact.rank == 0 || generic::decided_by_residues(values, true))
    return exact;
  MatX m = MatX::Zero(rows, columns);
  for (const Entry& e : entries) m(e.row, e.column) = e.value;
  exact.rank = std::min(exact.rank, sampled_rank(m, equations).value_or(exact.rank));
  return exact;
}

int generic_rank(const MatX& m) {
  std::vector<Entry> nonzero;
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      if (!m(i, j).is_zero()) nonzero.push_back({static_cast<int>(i), static_cast<int>(j), m(i, j)});
  return generic_rank(nonzero, static_cast<int>(m.rows()), static_cast<int>(m.cols())).rank;
}

Mat null_space(const Mat& m) {
  if (m.cols() == 0) return Mat(0, 0);
  if (m.rows() == 0) return Mat::Identity(m.cols(), m.cols());
  const Eigen::JacobiSVD<Mat> svd(m, Eigen::ComputeFullV);
  const int rank = numeric_rank(m);
  return svd.matrixV().rightCols(m.cols() - rank);
}

}  // namespace pendula::dae
