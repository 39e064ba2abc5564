#include "dae/array_points.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <random>

#include "base/interrupt.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double solved_below = 1e-11;  // scaled residual of a point
constexpr int max_iterations = 120;     // exponentials come down by one per Newton step
constexpr double rank_cut = 1e-8;       // relative to σ₁: σ above it always counts
constexpr double rounding = 1e-16;

Mat equilibrated(Mat m) {
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (Index i = 0; i < m.rows(); ++i)
      if (const double s = m.row(i).cwiseAbs().maxCoeff(); s > 0) m.row(i) /= s;
    for (Index j = 0; j < m.cols(); ++j)
      if (const double s = m.col(j).cwiseAbs().maxCoeff(); s > 0) m.col(j) /= s;
  }
  return m;
}

/// |r_i| relative to the size of its own terms.
double scaled_size(const Vec& r, const Mat& J, const Vec& w) {
  return r.size() ? r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * w.cwiseAbs()).maxCoeff()
                  : 0;
}

/// The least-norm step in the free unknowns, rows scaled to unit size.
Vec gauss_newton_step(const Vec& r, const Mat& J, Index held) {
  Mat scaled = J.rightCols(J.cols() - held);
  Vec right = -r;
  for (Index i = 0; i < scaled.rows(); ++i)
    if (const double s = scaled.row(i).cwiseAbs().maxCoeff(); s > 0) scaled.row(i) /= s, right[i] /= s;
  Eigen::CompleteOrthogonalDecomposition<Mat> qr;
  qr.setThreshold(1e-11);  // as in start.cpp: below it a direction counts as undetermined
  qr.compute(scaled);
  Vec step = Vec::Zero(J.cols());
  step.tail(J.cols() - held) = qr.solve(right);
  return step;
}

}  // namespace

RankGap rank_with_gap(const Mat& m) {
  if (m.size() == 0) return {0, 1 / rounding};
  const Eigen::JacobiSVD<Mat> svd(equilibrated(m));
  Vec s = svd.singularValues();
  if (!(s[0] > 0)) return {0, 1 / rounding};
  s = (s / s[0]).cwiseMax(rounding);
  RankGap best{static_cast<int>(s.size()), s[s.size() - 1] / rounding};
  if (s[s.size() - 1] > rank_cut) return best;
  best.gap = 0;
  for (Index i = 0; i + 1 < s.size(); ++i)
    if (s[i + 1] <= rank_cut && s[i] / s[i + 1] > best.gap) best = {static_cast<int>(i) + 1, s[i] / s[i + 1]};
  return best;
}

NumericArray::NumericArray(const DerivativeArray& array)
    : columns_(array.columns()),
      outputs_(array.rows()),
      entries_(sparse_jacobian(array.rows(), columns_)),
      rows_(array.rows().size()),
      states_(array.states().size()),
      first_(array.first().size()) {
  for (const Entry& e : entries_) outputs_.push_back(e.value);
}

std::unordered_map<Expr, double> NumericArray::known(int seed) const {
  const std::unordered_map<Expr, char> unknown = [&] {
    std::unordered_map<Expr, char> set;
    for (Expr c : columns_) set[c] = 1;
    return set;
  }();
  std::unordered_map<Expr, double> values;
  for (Expr leaf : leaves(outputs_)) {
    const Symbol& s = symbol_of(leaf);
    if (unknown.count(leaf) || s.kind == pendula::Kind::constant) continue;
    std::mt19937_64 random(std::hash<std::string>()(s.name) * 31 +
                           static_cast<unsigned>(s.order * 7919 + seed));
    values[leaf] = std::uniform_real_distribution<double>(0.5, 1.5)(random);
  }
  return values;
}

void NumericArray::evaluate_at(const Vec& w, const std::unordered_map<Expr, double>& known, Vec& r,
                               Mat& J) const {
  auto point = known;
  for (std::size_t j = 0; j < columns_.size(); ++j) point[columns_[j]] = w[static_cast<Index>(j)];
  const auto values = pendula::evaluate(outputs_, point);
  r = Eigen::Map<const Vec>(values.data(), static_cast<Index>(rows_));
  J = Mat::Zero(static_cast<Index>(rows_), w.size());
  for (std::size_t k = 0; k < entries_.size(); ++k)
    J(entries_[k].row, entries_[k].column) = values[rows_ + k];
}

std::optional<NumericArray::Solution> NumericArray::project(Vec w,
                                                            const std::unordered_map<Expr, double>& known,
                                                            Index held) const {
  Vec r, next_r;
  Mat J, next_J;
  evaluate_at(w, known, r, J);
  double last_step = INFINITY;
  int linear = 0;  // steps in a row that shrank only by a constant factor
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_interrupt();
    if (!r.allFinite() || !J.allFinite()) return {};
    const Vec step = gauss_newton_step(r, J, held);
    if (!step.allFinite()) return {};
    const bool solved = scaled_size(r, J, w) < solved_below;
    const double size = step.norm() / (1 + w.norm());
    if (solved && size < 1e-13) return Solution{w, linear >= 5};
    linear = size > 0.1 * last_step && size < 0.95 * last_step ? linear + 1 : 0;
    last_step = size;
    if (solved && linear >= 12) return Solution{w, true};
    double alpha = 1;
    for (; alpha > 1e-6; alpha /= 2) {
      evaluate_at(w + alpha * step, known, next_r, next_J);
      if (next_r.allFinite() && next_J.allFinite() && next_r.norm() <= (1 - 0.01 * alpha) * r.norm()) break;
    }
    if (alpha <= 1e-6) {  // no further decrease: rounding level, or no solution here
      if (!solved) return {};
      return Solution{w, linear >= 5};
    }
    w += alpha * step;
    r = next_r, J = next_J;
  }
  if (scaled_size(r, J, w) < solved_below) return Solution{w, true};
  return {};
}

ArrayRanks NumericArray::ranks(const Solution& at, const std::unordered_map<Expr, double>& known) const {
  Vec r;
  Mat J;
  evaluate_at(at.w, known, r, J);
  const auto x = static_cast<Index>(states_), n = static_cast<Index>(first_);
  const RankGap all = rank_with_gap(J), y = rank_with_gap(J.rightCols(J.cols() - x)),
                higher = rank_with_gap(J.rightCols(J.cols() - x - n));
  return {all.rank, y.rank, higher.rank, std::min({all.gap, y.gap, higher.gap}), at.slow};
}

}  // namespace pendula::dae
