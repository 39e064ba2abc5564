// Points at which the Jacobian of equations and fixes loses rank: the dimension of the solutions nearby.
// docs/derivations.md#start.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/decompositions.hpp"
#include "dae/rank/rank.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

class LocalSolutions {
 public:
  LocalSolutions(const StartSystem& s, const Vec& w, double threshold)
      : s_(s), w_(w), threshold_(threshold) {}

  /// A Jacobian with rows of unit length, its rank, and the directions that it leaves.
  struct Tangent {
    Mat J;
    Index rank = 0;
    Mat kernel;
  };
  Tangent tangent(const std::vector<Index>& rows) const {
    Tangent t{unit_rows(rows), 0, {}};
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(threshold_);
    qr.compute(Mat(t.J.transpose()));
    t.rank = qr.rank();
    t.kernel = full_q(qr.householderQ()).rightCols(w_.size() - t.rank);
    return t;
  }

  /// The dimension of the solutions of these rows near w; nothing where second derivatives do not decide it.
  std::optional<int> dimension(const std::vector<Index>& rows) const {
    const Tangent t = tangent(rows);
    const Index m = t.kernel.cols(), dependent = t.J.rows() - t.rank;
    if (m == 0 || dependent == 0 || all_lead_to_solutions(rows, t.kernel)) return static_cast<int>(m);
    if (m == 1) return 0;  // a function of one variable that is not constant has isolated zeros
    if (dependent > 1) return {};
    const Vec curvature = Eigen::SelfAdjointEigenSolver<Mat>(form(rows, t)).eigenvalues();
    const double size = curvature.cwiseAbs().maxCoeff(), none = std::max(visible, clear * size);
    if (curvature.minCoeff() > none || curvature.maxCoeff() < -none) return 0;
    if (curvature.minCoeff() < -none && curvature.maxCoeff() > none) return static_cast<int>(m) - 1;
    return {};
  }

 private:
  static constexpr double visible = 1e-6, clear = 1e-3;  // curvature of rows of unit size; beside the largest

  Mat unit_rows(const std::vector<Index>& rows) const {
    Mat J = Mat(s_.jacobian(w_))(rows, Eigen::all);
    for (Index i = 0; i < J.rows(); ++i)
      if (const double size = J.row(i).norm(); size > 0) J.row(i) /= size;
    return J;
  }

  /// uᵀF″ on the kernel for the left null vector u, by central differences of the Jacobian.
  Mat form(const std::vector<Index>& rows, const Tangent& t) const {
    constexpr double step = 1e-4;
    const Mat J = Mat(s_.jacobian(w_))(rows, Eigen::all);
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(threshold_);
    qr.compute(t.J);
    Vec u = full_q(qr.householderQ()).rightCols(1);
    for (Index i = 0; i < u.size(); ++i)
      if (const double size = J.row(i).norm(); size > 0) u[i] /= size;
    const double h = step * (1 + w_.cwiseQuotient(s_.unit).cwiseAbs().maxCoeff());
    Mat H(t.kernel.cols(), t.kernel.cols());
    for (Index b = 0; b < H.cols(); ++b) {
      const Vec move = h * t.kernel.col(b).cwiseProduct(s_.unit);
      const Mat change = Mat(s_.jacobian(w_ + move)) - Mat(s_.jacobian(w_ - move));
      const Vec slope = Mat(change(rows, Eigen::all)).transpose() * u / (2 * h);
      H.col(b) = t.kernel.transpose() * slope;
    }
    if (!H.allFinite()) return Mat::Zero(H.rows(), H.cols());
    return (H + H.transpose()) / 2;
  }

  /// Is there a solution within o(h) of w + h d for directions d of the kernel that no equation has chosen?
  /// Then the kernel is tangent to solutions of its dimension.
  bool all_lead_to_solutions(const std::vector<Index>& rows, const Mat& kernel) const {
    constexpr double near = 0.1;
    for (int look = 0; look < 2; ++look) {
      Vec d(kernel.cols());
      for (Index k = 0; k < d.size(); ++k)
        d[k] = std::fmod(static_cast<double>(k + 1 + 7 * look) * golden_fraction, 1.0) - 0.3;
      d.normalize();
      const auto off = [&](double h) {
        return distance(rows, w_ + h * (kernel * d).cwiseProduct(s_.unit)) / h;
      };
      if (!(off(1e-2) < near) && !(off(1e-3) < near)) return false;
    }
    return true;
  }

  /// How far Gauss-Newton goes from `from` to a solution, in units.
  double distance(const std::vector<Index>& rows, const Vec& from) const {
    constexpr int iterations = 40;
    Vec at = from;
    for (int k = 0; k < iterations; ++k) {
      const Mat J = Mat(s_.jacobian(at))(rows, Eigen::all);
      const Vec r = s_.residual(at)(rows);
      if (!J.allFinite() || !r.allFinite()) return INFINITY;
      const Vec step = Eigen::CompleteOrthogonalDecomposition<Mat>(J).solve(r);
      at -= step.cwiseProduct(s_.unit);
      if (step.norm() <= 1e-13) break;
    }
    return (at - from).cwiseQuotient(s_.unit).norm();
  }

  const StartSystem& s_;
  const Vec& w_;
  double threshold_;
};

void make_redundant_from(std::size_t from, Freedom& f) {
  for (std::size_t k = from; k < f.redundant.size(); ++k) f.redundant[k] = 1;
}

std::vector<Index> first_rows(std::size_t n) {
  std::vector<Index> rows(n);
  std::iota(rows.begin(), rows.end(), Index(0));
  return rows;
}

/// Where the equations lose rank, fixes can be independent to first order and yet follow from each other: z
/// from x in z² = x² at 0.
bool redundant_behind_isolating(const StartSystem& s, const LocalSolutions& near, Freedom& f) {
  std::vector<Index> rows = first_rows(s.first_fix);
  for (std::size_t k = 0; k < s.fixes(); ++k) {
    if (f.redundant[k]) continue;
    rows.push_back(static_cast<Index>(s.first_fix + k));
    if (near.dimension(rows) != 0) continue;
    make_redundant_from(k + 1, f);
    return true;
  }
  return false;
}

bool fixes_state(const StartSystem& s, std::size_t k) {
  const auto j = s.fixed_unknown(k);
  return j && *j < static_cast<Index>(s.state_count);
}

/// Can a state be what a value that is no state follows from? At a regular point the equations determine such
/// values, and their fixes are redundant: one that is independent belongs to an unknown whose column
/// vanishes.
bool may_be_stationary(const StartSystem& s, const Freedom& f) {
  bool redundant_state = false, independent_other = false;
  for (std::size_t k = 0; k < s.fixes(); ++k) {
    const bool state = fixes_state(s, k);
    redundant_state = redundant_state || (state && f.redundant[k]);
    independent_other = independent_other || (!state && !f.redundant[k]);
  }
  return redundant_state && independent_other;
}

/// Fixes that are redundant to first order and yet isolate the point: x = 1 at the double root of z² - 2 z +
/// x = 0. A fixed state does so before values that are no states.
void prefer_stationary_state(const StartSystem& s, const LocalSolutions& near, Freedom& f) {
  for (std::size_t k = 0; k < s.fixes(); ++k) {
    if (!f.redundant[k]) continue;
    std::vector<Index> rows = first_rows(s.first_fix);
    std::vector<std::size_t> left_out;
    for (std::size_t other = 0; other < s.fixes(); ++other) {
      if (f.redundant[other]) continue;
      if (fixes_state(s, k) && !fixes_state(s, other))
        left_out.push_back(other);
      else
        rows.push_back(static_cast<Index>(s.first_fix + other));
    }
    if (near.tangent(rows).kernel.cols() == 0) continue;
    rows.push_back(static_cast<Index>(s.first_fix + k));
    if (near.dimension(rows) != 0) continue;
    f.redundant[k] = 0;
    for (std::size_t other : left_out) f.redundant[other] = 1;
    return;
  }
}

}  // namespace

void refine_by_curvature(const StartSystem& s, const Vec& w, double threshold, Freedom& f) {
  constexpr Index most = 30;  // unknowns; dense decompositions in every step
  const bool loses_rank = f.rank_equations < static_cast<int>(s.first_fix);
  if (w.size() > most || s.request.nearest || (!loses_rank && !may_be_stationary(s, f))) return;
  if (!all_finite(s.jacobian(w))) return;
  const LocalSolutions near(s, w, threshold);
  const std::vector<Index> equations = first_rows(s.first_fix);
  if (near.tangent(equations).rank != f.rank_equations) return;
  const std::optional<int> dimension = near.dimension(equations);
  f.is_bound = !dimension;
  if (dimension) f.dimension = *dimension;
  // directions that are open to first order are asked for, even where the point is isolated
  const bool is_complete = f.count == 0 && std::find(f.chosen.begin(), f.chosen.end(), 1) == f.chosen.end();
  if (!is_complete) return;
  if (dimension == 0) return make_redundant_from(0, f);
  if (!loses_rank || !redundant_behind_isolating(s, near, f)) prefer_stationary_state(s, near, f);
}

}  // namespace pendula::dae
