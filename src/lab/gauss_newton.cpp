#include "lab/gauss_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
/// Of singular values of J with columns scaled to length 1: derivatives err by n ε, and at an iterate near a
/// singular solution by as much as the iterate.
constexpr double rank_threshold = 1e-9;

class Solver {
 public:
  Solver(const NumericFunction& f, const GaussNewtonSettings& settings, const Vec& start)
      : f_(f), settings_(settings), x_(start), R_(f.outputs), J_(f.outputs, f.n()), trial_R_(f.outputs) {
    scale_ = Vec::Zero(f.n());
  }

  GaussNewtonRun run() {
    f_.value(x_, R_);
    if (!R_.allFinite()) {
      std::string what = f_.undefined ? f_.undefined(x_) : "";
      throw Error("R is not finite at the start" + (what.empty() ? "" : "; " + what));
    }
    GaussNewtonEnding& ending = run_.ending;
    while (true) {
      poll_interrupt();
      linearise();
      if (!J_.allFinite()) {
        ending = GaussNewtonEnding::undefined;
        break;
      }
      const Vec step = gauss_newton_step();
      if (small(step) || R_.norm() <= noise()) {
        ending = has_run_away() ? GaussNewtonEnding::diverged : GaussNewtonEnding::converged;
        break;
      }
      if (run_.iterations() >= settings_.max) break;
      if (!advance(step)) {
        ending = stationary()     ? GaussNewtonEnding::converged
                 : R_.allFinite() ? GaussNewtonEnding::stalled
                                  : GaussNewtonEnding::undefined;
        break;
      }
    }
    finish();
    return std::move(run_);
  }

 private:
  void linearise() {
    if (f_.jacobian)
      f_.jacobian(x_, J_);
    else
      difference_jacobian(f_, x_, R_, 0, J_);
    run_.x.push_back(x_);
    run_.norm.push_back(R_.norm());
    run_.gradient.push_back((J_.transpose() * R_).norm());
    scale_ = scale_.cwiseMax(J_.colwise().norm().transpose());
    for (double& s : scale_)
      if (s == 0) s = 1;
    if (run_.x.size() == 1 && J_.allFinite()) rank_at_start_ = rank_of_jacobian();
  }
  int rank_of_jacobian() const {
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(rank_threshold);
    qr.compute(J_ * scale_.cwiseInverse().asDiagonal());
    return static_cast<int>(qr.rank());
  }
  /// Has the iteration diverged? Steps become small where unknowns have lost their influence, but then ‖R‖
  /// exceeds its value at the start, or the iterates are far away.
  bool has_run_away() const {
    constexpr double far = 1e6, larger = 1.001;  // choices; both count only where J has lost rank
    if (!(R_.norm() > larger * run_.norm.front()) && !(x_.norm() > far * (1 + run_.x.front().norm())))
      return false;
    return rank_of_jacobian() < rank_at_start_;
  }
  double noise() const { return rounding_of_terms * (J_.cwiseAbs() * x_.cwiseAbs()).norm(); }

  /// The minimum-norm solution of min ‖J Δx + R‖ in scaled unknowns.
  Vec gauss_newton_step() const {
    const Mat scaled = J_ * scale_.cwiseInverse().asDiagonal();
    Eigen::CompleteOrthogonalDecomposition<Mat> qr;
    qr.setThreshold(rank_threshold);
    qr.compute(scaled);
    return scale_.cwiseInverse().cwiseProduct(Vec(qr.solve(Vec(-R_))));
  }
  Vec marquardt_step(double lambda) const {
    const Index n = f_.n(), m = f_.outputs;
    Mat stacked(m + n, n);
    stacked << J_, Mat(std::sqrt(lambda) * scale_.asDiagonal().toDenseMatrix());
    Vec right = Vec::Zero(m + n);
    right.head(m) = -R_;
    return stacked.colPivHouseholderQr().solve(right);
  }

  bool small(const Vec& step) const {
    // The relative offset of Bates & Watts, Nonlinear Regression Analysis, 1988, §2.2.3: R is orthogonal to
    // the tangent space.
    if ((J_ * step).norm() <= settings_.tol * R_.norm()) return true;
    // unknowns much smaller than the largest count like a thousandth of it; all may be 0
    const double floor = 1e-3 * x_.lpNorm<Eigen::Infinity>() + least_size;
    for (Index j = 0; j < step.size(); ++j)
      if (!(std::fabs(step[j]) <= settings_.tol * std::max(std::fabs(x_[j]), floor))) return false;
    return true;
  }
  /// Is there no descent direction above rounding?
  bool stationary() const {
    constexpr double orthogonal = 1e-7;  // cosine: at a minimum known to √ε, the angle of R to a column of J
    const Vec g = J_.transpose() * R_;
    for (Index j = 0; j < g.size(); ++j)
      if (std::fabs(g[j]) > orthogonal * scale_[j] * R_.norm()) return false;
    return true;
  }

  bool accept(const Vec& step, double alpha, double lambda, bool always) {
    const Vec trial = x_ + alpha * step;
    f_.value(trial, trial_R_);
    const double before = R_.squaredNorm(), slope = 2 * alpha * (J_.transpose() * R_).dot(step);
    // a decrease below rounding cannot be tested; such steps are accepted. Else Armijo's condition with the
    // usual 10⁻⁴ (Nocedal & Wright, Numerical Optimization, 2nd ed., §3.1)
    constexpr double rounding = 1e-10, armijo = 1e-4;
    const double allowed = std::fabs(slope) < rounding * before ? rounding * before : armijo * slope;
    if (!always && !(trial_R_.squaredNorm() <= before + allowed && trial_R_.allFinite())) return false;
    x_ = trial;
    R_.swap(trial_R_);
    run_.alpha.push_back(alpha);
    run_.lambda.push_back(lambda);
    return true;
  }
  bool search(const Vec& step, double least) {
    for (double alpha = 1; alpha >= least; alpha /= 2)
      if (accept(step, alpha, 0, false)) return true;
    return false;
  }
  bool marquardt() {
    // Marquardt (J. Soc. Ind. Appl. Math. 11, 1963) multiplies and divides λ by 10. Below 10⁻¹⁵ it has no
    // effect on a step, beyond 10²⁰ the step has none on x; from one to the other 35 attempts are needed.
    constexpr double factor = 10, least = 1e-15, largest = 1e20;
    constexpr int attempts = 40;
    for (int attempt = 0; attempt < attempts; ++attempt) {
      if (accept(marquardt_step(lambda_), 1, lambda_, false)) {
        lambda_ = std::max(lambda_ / factor, least);
        return true;
      }
      lambda_ = std::min(lambda_ * factor, largest);
    }
    return false;
  }
  bool advance(const Vec& step) {
    switch (settings_.damping) {
      case Damping::fixed:
        accept(step, settings_.alpha, 0, true);
        return R_.allFinite() && x_.norm() < 1e100;  // before squares overflow
      case Damping::line_search:
        return search(step, 1e-6);  // twenty halvings: shorter steps hardly move x
      case Damping::marquardt:
        return marquardt();
      case Damping::automatic:
        return search(step, 1.0 / 16) || marquardt();  // a choice: shorter ones need another direction
    }
    return false;
  }

  void finish() {
    run_.R = run_.x.back() == x_ ? R_ : Vec(Vec::Constant(f_.outputs, NAN));
    run_.J = J_;
    if (!J_.allFinite() || !run_.R.allFinite()) return;
    find_rank();
    const auto m = f_.outputs;
    run_.exact_data = R_.norm() <= 100 * noise();  // a choice: the last step may leave more than rounding
    if (m > run_.rank) run_.variance = R_.squaredNorm() / (m - run_.rank);
    if (run_.rank == f_.n() && m > f_.n()) {
      // (JᵀJ)⁻¹ = D⁻¹ R⁻¹R⁻ᵀ D⁻¹ with J D⁻¹ = QR, which avoids squaring the condition number
      const Vec shrink = J_.colwise().norm().cwiseInverse();
      const Mat QR = (J_ * shrink.asDiagonal()).eval().householderQr().matrixQR();
      const Mat inverse = shrink.asDiagonal() * QR.topRows(f_.n()).triangularView<Eigen::Upper>().solve(
                                                    Mat::Identity(f_.n(), f_.n()));
      run_.covariance = run_.variance * inverse * inverse.transpose();
    }
  }
  void find_rank() {
    constexpr double last_bits = 1e-14;  // 45 ε: a column that is 0 but for rounding
    Vec length = J_.colwise().norm();
    for (double& s : length) s = s > last_bits * scale_.maxCoeff() ? s : 1;
    const Mat scaled = J_ * length.cwiseInverse().asDiagonal();
    const Eigen::JacobiSVD<Mat> svd(scaled.rows() >= scaled.cols() ? scaled : padded(scaled),
                                    Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Vec& sigma = svd.singularValues();
    run_.rank = 0;
    for (double s : sigma) run_.rank += s > rank_threshold * std::max(sigma[0], least_size) && s > 0;
    run_.undetermined =
        readable(length.cwiseInverse().asDiagonal() * svd.matrixV().rightCols(f_.n() - run_.rank));
  }
  /// A basis of the same space, by elimination, with many zeros and a largest component of 1.
  static Mat readable(Mat N) {
    std::vector<Index> pivots;
    for (Index k = 0; k < N.cols(); ++k) {
      Index row = 0;
      Vec free = N.col(k).cwiseAbs();
      for (Index p : pivots) free[p] = 0;
      free.maxCoeff(&row);
      for (Index other = 0; other < N.cols(); ++other)
        if (other != k) N.col(other) -= N.col(k) * (N(row, other) / N(row, k));
      pivots.push_back(row);
    }
    for (auto column : N.colwise()) {
      const double most = column.cwiseAbs().maxCoeff();
      Index first = 0;
      while (std::fabs(column[first]) < (1 - no_component) * most) ++first;
      column /= column[first];
    }
    return N;
  }
  /// Adds zero rows if there are fewer residuals than unknowns.
  static Mat padded(const Mat& A) {
    Mat square = Mat::Zero(A.cols(), A.cols());
    square.topRows(A.rows()) = A;
    return square;
  }

  const NumericFunction& f_;
  const GaussNewtonSettings& settings_;
  Vec x_, R_;
  Mat J_;
  Vec trial_R_, scale_;
  int rank_at_start_ = 0;
  double lambda_ = 1e-3;  ///< at first: nearly a Gauss–Newton step
  GaussNewtonRun run_;
};

/// x⋆ by Newton's method with the exact Hessian, from the last iterate.
Vec polished(const NumericFunction& f, Vec x) {
  Vec R(f.outputs);
  Mat J(f.outputs, f.n()), S(f.n(), f.n());
  double previous = std::numeric_limits<double>::infinity();
  constexpr int most = 30;  // a cap: convergence is quadratic
  for (int k = 0; k < most; ++k) {
    f.value(x, R);
    f.jacobian(x, J);
    f.curvature(x, R, S);
    const Vec correction = Mat(J.transpose() * J + S).partialPivLu().solve(Vec(J.transpose() * R));
    const double length = correction.norm();
    if (!std::isfinite(length) || length >= previous) break;
    x -= correction;
    previous = length;
    if (length <= 2 * eps * x.norm()) break;
  }
  return x;
}

/// Predicts and measures the rate: the cost of neglecting S.
void analyse(const NumericFunction& f, GaussNewtonRun& run) {
  if (!run.converged() || run.rank < f.n() || run.iterations() == 0) return;
  const Mat JtJ = run.J.transpose() * run.J;
  Vec root = run.x.back();
  if (f.curvature && f.jacobian) {
    run.S.resize(f.n(), f.n());
    f.curvature(root, run.R, run.S);
    if (run.S.allFinite()) {
      const Mat relative = JtJ.partialPivLu().solve(run.S);
      const Vec eigenvalues = relative.eigenvalues().real();  // real: S symmetric, JᵀJ positive definite
      run.curvature = 1 + eigenvalues.minCoeff();
      const double alpha = run.alpha.back();
      if (!(run.lambda.back() > 0))
        for (double e : eigenvalues)
          if (const double part = std::fabs(1 - alpha * (1 + e)); part >= run.predicted.value_or(0))
            run.predicted = part;
      constexpr double definite = 0.01;  // relative to JᵀJ; flatter minima may be none
      if (run.curvature > definite) root = polished(f, root);
    }
  }
  // the rounding error of the gradient JᵀR is that of its terms
  const Vec gradient_noise = rounding_of_terms * (run.J.cwiseAbs().transpose() *
                                                  (run.R.cwiseAbs() + run.J.cwiseAbs() * root.cwiseAbs()));
  double largest = 0;
  for (const Vec& x : run.x) largest = std::max(largest, x.norm());
  const double noise = 4 * eps * largest + (inverse_by_lu(JtJ).cwiseAbs() * gradient_noise).norm();
  run.observed = observe(run.x, root, noise, run.predicted.value_or(0) > linear_in_the_end);
}

}  // namespace

const char* ending_name(GaussNewtonEnding ending) {
  const char* const names[] = {"converged", "not converged", "diverged", "stalled", "undefined"};
  return names[static_cast<int>(ending)];
}

GaussNewtonRun gauss_newton(const NumericFunction& R, const GaussNewtonSettings& settings, const Vec& start) {
  PENDULA_ASSERT(start.size() == R.n() && R.outputs > 0, "least squares with wrong sizes");
  GaussNewtonRun run = Solver(R, settings, start).run();
  analyse(R, run);
  run.verdict = gauss_newton_verdict(R, run);
  return run;
}

}  // namespace pendula::lab
