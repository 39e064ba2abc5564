#include "integrate/event/monitor/pole_test.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace pendula::integrate {
namespace {

// A zero is looked at from distances of 10⁻² of the way, of which two more are 10⁻³ each of the one before.
constexpr double closer = 1e-3, first_distance = 1e-2;
// Rounding errors of distances must stay below 10⁻² of the last of them.
constexpr double above_noise = 1e8;
// Order of a pole from which on it ends a run: 1 but for what smooth terms beside it contribute.
constexpr double not_integrable = 0.95;

/// After a border that was located at the zero a step begins there: nothing of it lies before.
bool begins_at(double zero) { return zero <= above_noise * std::numeric_limits<double>::epsilon(); }

/// Of the way between the points, on the side of the zero from which the solution comes, if there is one.
double room(double zero) { return begins_at(zero) ? 1 - zero : zero; }

/// The order q of a pole, from residuals at three such distances; far below 0 for a function that is bounded
/// or changes only by rounding errors, 0 for a logarithm.
double pole_order(double far, double middle, double near) {
  constexpr double visible = 1e-3;  // of the residual; rounding errors are below 10⁻⁸
  const double change = std::fabs(middle - far);
  if (!std::isfinite(near) || !(change > visible * std::fabs(far))) return -1;
  return std::log(std::fabs(near - middle) / change) / -std::log(closer);
}

}  // namespace

PoleTest::PoleTest(const ProblemPtr& equations, bool determined, Expr factor, const Tolerances& tolerances,
                   const Point& from, const Point& to)
    : equations_(*equations),
      tolerances_(tolerances),
      factor_(std::vector{factor}, equations->arguments()),
      from_(from),
      to_(to),
      offset_(Vec::Zero(from.x.size())) {
  if (determined) rhs_.emplace(equations, ignored_);
}

bool PoleTest::is_pole() {
  const auto on_line = zero();
  if (!on_line) return false;
  if (grows(*on_line) || oscillates(*on_line)) return true;
  // a/x is constant on a line on which a and x both vanish, and oscillates next to that line
  constexpr double golden = 0.618, beside = 0.05;  // of the step
  for (int i = 0; i < offset_.size(); ++i)
    offset_[i] = beside * (to_.x[i] - from_.x[i]) * (std::fmod(golden * (i + 1), 1.0) - 0.5);
  const auto next = zero();
  const bool diverges = next && oscillates(*next);
  offset_.setZero();
  return diverges;
}

double PoleTest::integrable_error() {
  // log|x| has q = 0; the logarithm of a distance of 10⁻⁸ beside 1 lets it appear as 0.02
  constexpr double least_order = 0.1;
  // the weight of a stage at one end of a step: 1/9 in Radau IIA, 35/384 in dopri5
  constexpr double of_end = 0.1;
  const auto at = rhs_ ? zero() : std::nullopt;
  if (!at) return 0;
  const double distance = std::max(first_distance * room(at->share), above_noise * at->noise);
  const Residuals F = towards(at->share, distance, closer, 3, What::rates);
  double worst = 0;
  for (std::size_t i = 0; i < F[0].size(); ++i) {
    const double q = pole_order(F[0][i], F[1][i], F[2][i]);
    if (!(q > least_order && q < not_integrable)) continue;
    const double K =
        std::fabs(F[2][i] - F[1][i]) / (std::pow(distance * closer, -q) * (std::pow(closer, -q) - 1));
    const double area = K * (std::pow(at->share, 1 - q) + std::pow(1 - at->share, 1 - q)) / (1 - q);
    const double stage = std::max(std::fabs(from_.xdot[i]), std::fabs(to_.xdot[i]));
    worst = std::max(worst, (area + of_end * stage) * std::fabs(to_.t - from_.t) / tolerance(i));
  }
  return worst;
}

PoleTest::Crossing PoleTest::crossing() {
  constexpr double at_rest = 0.01;              // relative to the rate before it
  constexpr double beside = 0.05, near = 0.02;  // of the step
  // of the rate at two and a half times the distance: x³ (0.16) and x (0.4) reach 0 gradually
  constexpr double steady = 0.5;
  const auto at = rhs_ ? zero() : std::nullopt;
  if (!at) return Crossing::possible;
  const double direction = value(1) > value(0) ? 1 : -1;
  const auto rate = [&](double distance) {
    return direction * factor_rate(std::clamp(at->share + distance, 0.0, 1.0));
  };
  const double before = rate(-beside), after = rate(beside);
  if (!(before > 0) || !(rate(0) < at_rest * before)) return Crossing::possible;
  const bool narrow = rate(-near) > steady * before && after > 0 && rate(near) > steady * after;
  return narrow ? Crossing::jumped : Crossing::impossible;
}

std::optional<double> PoleTest::parting_time() {
  constexpr Eigen::Index most = 60;      // unknowns
  constexpr double fine_enough = 5e-10;  // the interior is visible beside rounding errors
  if (!equations_.is_ode() || equations_.has_dense_jacobian() || offset_.size() > most) return {};
  const auto at = zero();
  if (!at) return {};
  const bool fine = at->noise < fine_enough;
  if (!is_singular(1, at->share, 1 - at->share, fine) && !is_singular(-1, at->share, at->share, fine))
    return {};
  return from_.t + at->share * (to_.t - from_.t);
}

std::optional<PoleTest::Zero> PoleTest::zero() {
  constexpr int halvings = 60;  // beyond the 52 bits of a share
  const double g0 = value(0), g1 = value(1);
  // a zero on the line need not have one next to it
  if (offset_.squaredNorm() > 0 && !(g0 * g1 <= 0)) return {};
  double low = 0, high = 1;
  for (int k = 0; k < halvings; ++k) {
    const double middle = (low + high) / 2, g = value(middle);
    ((g1 > g0 ? g < 0 : g > 0) ? low : high) = middle;
  }
  const double noise = std::max(std::fabs(value(low)), std::fabs(value(high))) / std::fabs(g1 - g0);
  return Zero{low, noise};
}

bool PoleTest::grows(const Zero& zero) {
  // Poles of lower order are integrable. Of a DAE the residuals count, in which z grows, too; what a step
  // misses at a pole of low order is not known there.
  const bool ode = equations_.is_ode();
  const double least_order = ode ? not_integrable : 0.43;
  constexpr double steep = 20;  // growth of the whole residual, in which a pole of order 0.43 dominates
  const double distance = std::max(first_distance * room(zero.share), above_noise * zero.noise);
  const Residuals F = towards(zero.share, distance, closer, 3, ode ? What::rates : What::residuals);
  for (std::size_t i = 0; i < F[0].size(); ++i)
    if (pole_order(F[0][i], F[1][i], F[2][i]) > least_order &&
        std::fabs(F[2][i]) > steep * std::fabs(F[1][i]))
      return true;
  return false;
}

/// For ODEs only, since residuals along a solution are rounding errors. Several sequences of distances, since
/// an oscillation may by chance look monotone on one of them.
bool PoleTest::oscillates(const Zero& zero) {
  if (!equations_.is_ode()) return false;
  for (double part : {1.0, 0.83, 0.71, 0.57})
    if (oscillates_from(zero.share, std::max(0.1 * part * zero.share, above_noise * zero.noise / part)))
      return true;
  return false;
}

/// If F has a limit or grows like a logarithm, its changes from a distance to half of it decrease or keep
/// their sign. Those of cos(1/x) do neither.
bool PoleTest::oscillates_from(double zero, double distance) {
  constexpr int half = 6;
  constexpr double visible = 1e-2;  // of x′
  const double dt = std::fabs(to_.t - from_.t);
  const Residuals F = towards(zero, distance, 0.5, 2 * half + 1, What::rates);
  for (std::size_t i = 0; i < F[0].size(); ++i) {
    double size = 0, early = 0, late = 0, last = 0;
    int turns = 0;
    for (int k = 0; k < 2 * half; ++k) {
      const double change = F[k + 1][i] - F[k][i];
      size = std::max(size, std::fabs(F[k][i]));
      (k < half ? early : late) += std::fabs(change);
      turns += k >= half && change * last < 0 ? 1 : 0;
      last = change;
    }
    if (turns >= 2 && late > 0.3 * early && late > visible * size && late * dt > hardly(i)) return true;
  }
  return false;
}

/// The effect of an oscillation on xᵢ in the step that is still negligible: a tolerance, and at most 10⁻⁶
/// of the size of x where the tolerance is loose.
double PoleTest::hardly(std::size_t i) const {
  const double rtol = tolerances_.rtol[i];
  return std::min(1.0, 1e-6 / rtol) * tolerance(i);
}

double PoleTest::tolerance(std::size_t i) const {
  const auto k = static_cast<Eigen::Index>(i);
  return tolerances_.atol[k] + tolerances_.rtol[k] * (std::fabs(from_.x[k]) + std::fabs(to_.x[k]));
}

/// x′ or F at distances from the zero that shrink by a constant factor, on the side that room() measures. The
/// residuals of an ODE contain x′ of the line, which would hide the growth near a pole.
PoleTest::Residuals PoleTest::towards(double zero, double distance, double factor, int count, What what) {
  const double side = begins_at(zero) ? 1 : -1;
  const int rows = equations_.n() + (what == What::residuals ? equations_.m() : 0);
  Residuals F(count, std::vector<double>(rows));
  for (std::vector<double>& at : F) {
    value(zero + side * distance);
    if (what == What::residuals)
      equations_.residual(at.data());
    else if (!rates_here(at.data()))
      std::fill(at.begin(), at.end(), std::numeric_limits<double>::quiet_NaN());
    distance *= factor;
  }
  return F;
}

/// Does the growth rate of disturbances approach k/distance in this direction? In steps of some 10⁻⁹ of the
/// run rounding hides the interior, and the rate at the end of the step decides: a bounded rate has no effect
/// in such a step.
bool PoleTest::is_singular(int direction, double zero, double room, bool fine) {
  // of k; a bounded ∂x′/∂x gives a tenth of it at the closer point
  constexpr double slow = 0.1, constant = 3;
  const double far = fine ? 0.2 * room : room, close = 0.1 * far;
  const double k = growth(zero + direction * far, direction) * far;
  return k > slow && (!fine || growth(zero + direction * close, direction) * close > k / constant);
}

/// The largest Re λ of ±∂x′/∂x, in units of 1/step size.
double PoleTest::growth(double share, int sign) {
  value(share);
  const Eigen::Index n = offset_.size();
  Mat F = Mat::Zero(n, 2 * n);  // ∂F/∂(x, x′)
  const std::vector<double>& partials = equations_.jacobian();
  for (std::size_t k = 0; k < partials.size(); ++k) {
    const auto [row, column] = equations_.pattern()[k];
    F(row, column) = partials[k];
  }
  const Mat J = -sign * F.rightCols(n).partialPivLu().solve(F.leftCols(n));
  if (!J.allFinite()) return 0;
  const Eigen::EigenSolver<Mat> solver(J, false);
  if (solver.info() != Eigen::Success) return 0;
  return solver.eigenvalues().real().maxCoeff() * (to_.t - from_.t);
}

/// dg/dt of the factor g along the solution through the point at this share of the step, by a difference.
double PoleTest::factor_rate(double share) {
  const double g = value(share), moment = 1e-6 * (to_.t - from_.t);
  Vec xdot(point_.x.size());
  if (!rates_here(xdot.data())) return std::numeric_limits<double>::quiet_NaN();
  point_.t += moment;
  point_.x += moment * xdot;
  return (value_here() - g) / moment;
}

/// x′ of the equations at point_. False where they have none, or one on another branch.
bool PoleTest::rates_here(double* xdot) {
  if (!equations_.is_ode()) {
    Vec z = point_.z;
    std::copy_n(point_.xdot.data(), point_.xdot.size(), xdot);
    return (*rhs_)(point_.t, point_.x.data(), xdot, z.data());
  }
  equations_.rhs(xdot);
  return true;
}

/// Sets the equations to the point at this share of the step and returns the factor there.
double PoleTest::value(double share) {
  const double inside = std::max(share, 0.0);
  point_.t = from_.t + share * (to_.t - from_.t);
  point_.x = from_.x + share * (to_.x - from_.x) + offset_;
  point_.xdot = from_.xdot + inside * (to_.xdot - from_.xdot);
  point_.z = from_.z + inside * (to_.z - from_.z);
  return value_here();
}

double PoleTest::value_here() {
  equations_.set_point(point_.t, point_.x.data(), point_.xdot.data(), point_.z.data());
  double g = 0;
  factor_(equations_.values().data(), &g);
  return g;
}

}  // namespace pendula::integrate
