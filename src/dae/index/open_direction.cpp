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

/// F_k and its Jacobian as numbers, rows of unit length.
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
  bool evaluate(const Vec& w, int seed, Vec& r, Sparse& J) const {
    std::vector<double> leaves(w.data(), w.data() + w.size());
    const auto known = numeric_.known(seed);
    for (Expr leaf : others_) leaves.push_back(known.at(leaf));
    const std::vector<double> values = (*evaluator_)(leaves);
    if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) return false;
    std::vector<Eigen::Triplet<double>> triplets;
    for (std::size_t k = 0; k < entries_.size(); ++k)
      triplets.emplace_back(entries_[k].row, entries_[k].column, values[static_cast<std::size_t>(rows_) + k]);
    J.resize(rows_, static_cast<Index>(columns_.size()));
    J.setFromTriplets(triplets.begin(), triplets.end());
    const Vec weight = row_weights(J);
    r = Eigen::Map<const Vec>(values.data(), rows_).cwiseProduct(weight);
    J = weight.asDiagonal() * J;
    return true;
  }

  /// Gauss-Newton from the starting values of a seed to F_k = 0. Nothing where it does not converge.
  std::optional<Vec> point(int seed) const {
    constexpr int most = 40;               // steps
    constexpr double last_digits = 1e-12;  // of the length of w, as in array_points
    Vec w = numeric_.start(seed), r;
    Sparse J;
    for (int k = 0; k < most; ++k) {
      poll_interrupt();
      if (!evaluate(w, seed, r, J)) return {};
      const Vec step = sparse_least_step(J, r);
      if (!step.allFinite()) return {};
      w += step;
      if (step.norm() <= last_digits * (1 + w.norm())) return w;
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
constexpr int refinements = 3;   // of regularised solutions

/// Of length about √n/4, no two entries alike.
Vec random_direction(Index first, Index length) {
  Vec v = Vec::Zero(length);
  for (Index j = 0; j < first; ++j) v[j] = std::fmod(static_cast<double>(j + 1) * golden_fraction, 1.0) - 0.5;
  return v;
}

/// Projects a direction of x′ onto the null space of Y = ∂F_k/∂(x′, x″ …).
bool is_open(const Sparse& Y, Index first) {
  constexpr double part = 1e-4;  // of the length: far above rounding errors
  Vec v = random_direction(first, Y.cols());
  for (int k = 0; k < refinements; ++k) {
    const Vec off = sparse_least_step(Y, Y * v);
    if (!off.allFinite()) return false;
    v += off;
  }
  const double length = v.norm();
  return length > part && (Y * v).cwiseAbs().maxCoeff() <= exact * length &&
         v.head(first).norm() > part * length;
}

/// Is a direction of x′ in the range of Yᵀ?
bool is_determined(const Sparse& Y, Index first) {
  const Sparse transposed = Y.transpose();
  const Vec c = random_direction(first, Y.cols());
  Vec combination = Vec::Zero(Y.rows()), off = -c;
  for (int k = 0; k < refinements; ++k) {
    combination += sparse_least_step(transposed, off);
    if (!combination.allFinite()) return false;
    off = transposed * combination - c;
  }
  return off.cwiseAbs().maxCoeff() <= exact * (c.norm() + combination.cwiseAbs().maxCoeff());
}

}  // namespace

DirectionCount count_directions(const DerivativeArray& array, int wanted) {
  constexpr int seeds = 8;
  const SparseArray numbers(array);
  const auto states = static_cast<Index>(array.states().size()),
             first = static_cast<Index>(array.first().size());
  DirectionCount count;
  for (int seed = 0; seed < seeds && count.open + count.determined < wanted; ++seed) {
    const auto w = numbers.point(seed);
    Vec r;
    Sparse J;
    if (!w || !numbers.evaluate(*w, seed, r, J)) continue;
    const Sparse Y = J.rightCols(J.cols() - states);
    if (is_open(Y, first))
      ++count.open;
    else
      count.determined += is_determined(Y, first);
  }
  return count;
}

}  // namespace pendula::dae
