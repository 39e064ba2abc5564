#include "dae/index/open_direction.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "base/interrupt.hpp"
#include "dae/newton/least_step.hpp"
#include "dae/newton/sparse_solution.hpp"
#include "dae/points/array_points.hpp"
#include "dae/rank/rank.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;

/// F_k and its Jacobian as numbers, in unknowns of the sizes that the equations tell, ω = w/size, and rows of
/// unit length: steps, null vectors and ranks are then the same in any units.
class SparseArray {
 public:
  explicit SparseArray(const DerivativeArray& array)
      : entries_(array.jacobian()),
        columns_(array.columns()),
        rows_(static_cast<Index>(array.rows().size())),
        numeric_(array) {
    std::vector<Expr> outputs = array.rows();
    for (const Entry& e : entries_) outputs.push_back(e.value);
    std::vector<Expr> leaves = columns_;
    for (const auto& [leaf, value] : numeric_.known(0)) others_.push_back(leaf);
    leaves.insert(leaves.end(), others_.begin(), others_.end());
    evaluator_.emplace(outputs, leaves);
  }

  /// False where a value is not finite.
  bool evaluate(const Vec& omega, int seed, Vec& r, Sparse& J) const {
    const Vec w = omega.cwiseProduct(numeric_.unit());
    std::vector<double> leaves(w.data(), w.data() + w.size());
    const auto known = numeric_.known(seed);
    for (Expr leaf : others_) leaves.push_back(known.at(leaf));
    const std::vector<double> values = (*evaluator_)(leaves);
    if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) return false;
    std::vector<Eigen::Triplet<double>> triplets;
    for (std::size_t k = 0; k < entries_.size(); ++k)
      triplets.emplace_back(
          entries_[k].row, entries_[k].column,
          values[static_cast<std::size_t>(rows_) + k] * numeric_.unit()[entries_[k].column]);
    J.resize(rows_, static_cast<Index>(columns_.size()));
    J.setFromTriplets(triplets.begin(), triplets.end());
    const Vec weight = row_weights(J);
    r = Eigen::Map<const Vec>(values.data(), rows_).cwiseProduct(weight);
    J = weight.asDiagonal() * J;
    return true;
  }

  /// Gauss-Newton from the starting values of a seed to F_k = 0. Nothing where it does not converge, or
  /// to a least |F_k| that is not 0.
  std::optional<Vec> point(int seed) const {
    constexpr int most = 40;               // steps
    constexpr double last_digits = 1e-12;  // of the length of ω, as in array_points
    constexpr double solved = 1e-10;       // of ω: rows, of unit size, are sums of some hundred terms
    Vec omega = numeric_.start(seed).cwiseQuotient(numeric_.unit()), r;
    Sparse J;
    if (!evaluate(omega, seed, r, J)) return {};
    for (int k = 0; k < most; ++k) {
      poll_interrupt();
      Vec step = sparse_least_step(J, r);
      if (!step.allFinite()) return {};
      // Where a slope is small, as that of y³ near 0, a step leads far away, and the point found there has no
      // digits for ranks. Each unknown for itself: the others of a large model are nearly solved for.
      const Vec longest = Vec::Ones(omega.size()) + omega.cwiseAbs();
      step = step.cwiseMin(longest).cwiseMax(-longest);
      const bool ends = step.norm() <= last_digits * (1 + omega.norm());
      omega += step;
      if (!evaluate(omega, seed, r, J)) return {};
      if (!ends) continue;
      const bool zero = r.cwiseAbs().maxCoeff() <= solved * (1 + omega.cwiseAbs().maxCoeff());
      return zero ? std::optional(omega) : std::nullopt;
    }
    return {};
  }

 private:
  const std::vector<Entry>& entries_;
  std::vector<Expr> columns_, others_;
  Index rows_;
  NumericArray numeric_;
  std::optional<Evaluator> evaluator_;
};

constexpr double exact = 1e-11;  // of the length of a vector: rounding errors of sums of some hundred terms
/// Refinements of a regularised solution: one leaves μ²/(σ² + μ²), μ = 10⁻⁶, of a direction with the singular
/// value σ. They end where the rest is no longer halved; 40 halvings are all digits of a direction at σ = μ.
class Refinement {
 public:
  bool goes_on(double rest) {
    const bool halved = rest < 0.5 * rest_;
    rest_ = rest;
    return count_++ < most && (halved || count_ <= usual);
  }

 private:
  static constexpr int usual = 3, most = 40;  // usual: rounding errors of LDLᵀ need as many
  int count_ = 0;
  double rest_ = INFINITY;
};

/// Of length about √n/4, no two entries alike.
Vec random_direction(Index first, Index length) {
  Vec v = Vec::Zero(length);
  for (Index j = 0; j < first; ++j) v[j] = std::fmod(static_cast<double>(j + 1) * golden_fraction, 1.0) - 0.5;
  return v;
}

/// Projects a direction of x′ onto the null space of Y = ∂F_k/∂(x′, x″ …).
bool is_open(const Sparse& Y, Index first) {
  constexpr double part = 1e-4;  // of the length: far above rounding errors
  // of the length: a rest of rounding errors, 10⁻¹⁶; couplings around a ring of 100 leave 10⁻¹² of a
  // direction that is determined
  constexpr double zero = 1e-14;
  Vec v = random_direction(first, Y.cols());
  for (Refinement refinement; refinement.goes_on((Y * v).cwiseAbs().maxCoeff());) {
    const Vec off = sparse_least_step(Y, Y * v);
    if (!off.allFinite()) return false;
    v += off;
  }
  const double length = v.norm();
  return length > part && (Y * v).cwiseAbs().maxCoeff() <= zero * length &&
         v.head(first).norm() > part * length;
}

/// Is a direction of x′ in the range of Yᵀ?
bool is_determined(const Sparse& Y, Index first) {
  const Sparse transposed = Y.transpose();
  const Vec c = random_direction(first, Y.cols());
  Vec combination = Vec::Zero(Y.rows()), off = -c;
  for (Refinement refinement; refinement.goes_on(off.cwiseAbs().maxCoeff());) {
    combination += sparse_least_step(transposed, off);
    if (!combination.allFinite()) return false;
    off = transposed * combination - c;
  }
  return off.cwiseAbs().maxCoeff() <= exact * (c.norm() + combination.cwiseAbs().maxCoeff());
}

/// Rows and columns of an array at a point.
struct Slopes {
  Sparse all, y;  ///< ∂F_k/∂(x, x′, x″ …), and without the columns of x
  Index first;    ///< columns of x′
  /// The conditions on x: those combinations of the rows that do not contain x′, x″ …
  Index conditions() const { return sparse_rank(all) - sparse_rank(y); }
};

DirectionCount look(const Slopes& at) {
  if (is_open(at.y, at.first)) return {1, 0};
  return {0, is_determined(at.y, at.first) ? 1 : 0};
}

/// Adds up what points say, up to `wanted` that agree; visit(slopes) where x′ is determined. A point where it
/// is outweighs those where it seems open: ranks fall at some points, and rise at none.
template <class Visit>
DirectionCount count_at_points(const DerivativeArray& array, int wanted, const Visit& visit) {
  constexpr int seeds = 24;  // some begin two to five times as large, where powers outweigh couplings
  const SparseArray numbers(array);
  const auto states = static_cast<Index>(array.states().size());
  Slopes slopes{{}, {}, static_cast<Index>(array.first().size())};
  DirectionCount count;
  for (int seed = 0; seed < seeds && std::max(count.open, count.determined) < wanted; ++seed) {
    const auto omega = numbers.point(seed);
    Vec r;
    if (!omega || !numbers.evaluate(*omega, seed, r, slopes.all)) continue;
    slopes.y = slopes.all.rightCols(slopes.all.cols() - states);
    const DirectionCount here = look(slopes);
    count.determined += here.determined;
    count.open = count.determined > 0 ? 0 : count.open + here.open;
    if (here.determined > 0) visit(slopes);
  }
  return count;
}

}  // namespace

DirectionCount count_directions(const DerivativeArray& array, int wanted) {
  return count_at_points(array, wanted, [](const Slopes&) {});
}

std::optional<DirectionIndex> index_by_directions(DerivativeArray array, int most) {
  constexpr int enough = 2;                    // points; a single one may be an accident
  constexpr std::size_t most_nodes = 400'000;  // as in array_index
  for (int k = 0; k <= most && topological(array.rows()).size() <= most_nodes; ++k, array.extend()) {
    std::vector<Index> conditions;
    const DirectionCount count =
        count_at_points(array, enough, [&](const Slopes& at) { conditions.push_back(at.conditions()); });
    if (count.open == enough) continue;
    if (count.determined < enough || conditions.front() != conditions.back()) return {};
    const auto states = static_cast<Index>(array.states().size());
    return DirectionIndex{k, static_cast<int>(states - conditions.front())};
  }
  return {};
}

}  // namespace pendula::dae
