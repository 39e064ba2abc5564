#include "integrate/event/monitor/domain_monitor.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {
namespace {

/// Do the equations diverge, or oscillate ever faster like cos(1/x), towards a zero of the factor on the
/// straight line through two points? Before the first point x′ and z are kept constant. Requires that the
/// zero lies between the points, or that the factor is 0 at the second.
class PoleTest {
 public:
  PoleTest(Problem& equations, Expr factor, const Tolerances& tolerances, const Point& from, const Point& to)
      : equations_(equations),
        tolerances_(tolerances),
        factor_(std::vector{factor}, equations.arguments()),
        from_(from),
        to_(to),
        offset_(Vec::Zero(from.x.size())) {}

  bool operator()() {
    if (is_worse([&](double zero, double noise) { return grows(zero, noise) || oscillates(zero, noise); }))
      return true;
    // a/x is constant on a line on which a and x both vanish, and oscillates next to that line
    constexpr double golden = 0.618;
    for (int i = 0; i < offset_.size(); ++i)
      offset_[i] = near * (to_.x[i] - from_.x[i]) * (std::fmod(golden * (i + 1), 1.0) - 0.5);
    if (is_worse([&](double zero, double noise) { return oscillates(zero, noise); })) return true;
    offset_.setZero();
    return false;
  }

  /// Do solutions diverge from each other after a zero that is not a pole? If a disturbance grows like δ′ = k
  /// δ/t, k > 0, as for x′ = k x/t, all solutions x = c tᵏ start from one point. If it decays like that
  /// before the zero, all of them meet there. For ODEs only. Returns the time of the zero.
  std::optional<double> parting_time() {
    constexpr Eigen::Index most = 60;  // unknowns
    if (!equations_.is_ode() || equations_.has_dense_jacobian() || offset_.size() > most) return {};
    double at = 0;
    const bool singular = is_worse([&](double zero, double noise) {
      at = from_.t + zero * (to_.t - from_.t);
      const bool fine = 1e8 * noise < near;
      return is_singular(1, zero, 1 - zero, fine) || is_singular(-1, zero, zero, fine);
    });
    return singular ? std::optional(at) : std::nullopt;
  }

 private:
  static constexpr double near = 0.05;  // of a step

  template <class Judge>
  bool is_worse(const Judge& judge) {
    const double g0 = value(0), g1 = value(1);
    if (offset_.squaredNorm() > 0 && !(g0 * g1 <= 0))
      return false;  // a zero on the line need not have one next to it
    double low = 0, high = 1;
    for (int k = 0; k < 60; ++k) {
      const double middle = (low + high) / 2, g = value(middle);
      ((g1 > g0 ? g < 0 : g > 0) ? low : high) = middle;
    }
    // rounding error of a distance, as a share of the step
    const double noise = std::max(std::fabs(value(low)), std::fabs(value(high))) / std::fabs(g1 - g0);
    return judge(low, noise);
  }

  bool grows(double zero, double noise) {
    constexpr double steep = 20;  // growth of |F| over 10⁻³ of the distance: a pole of order above 0.43
    const std::vector<std::vector<double>> F = before(zero, std::max(1e-2 * zero, 1e8 * noise), 1e-3, 3);
    for (std::size_t i = 0; i < F[0].size(); ++i) {
      const double change = std::fabs(F[1][i] - F[0][i]);
      if (!std::isfinite(F[2][i])) continue;
      if (std::fabs(F[2][i]) > steep * std::fabs(F[1][i]) && std::fabs(F[2][i] - F[1][i]) > steep * change &&
          change > 1e-3 * std::fabs(F[0][i]))
        return true;
    }
    return false;
  }

  /// For ODEs only, since residuals along a solution are rounding errors. Several sequences of distances,
  /// since an oscillation may by chance look monotone on one of them.
  bool oscillates(double zero, double noise) {
    if (!equations_.is_ode()) return false;
    for (double part : {1.0, 0.83, 0.71, 0.57})
      if (oscillates_from(zero, std::max(0.1 * part * zero, 1e8 * noise / part))) return true;
    return false;
  }

  /// If F has a limit or grows like a logarithm, its changes from a distance to half of it decrease or keep
  /// their sign. Those of cos(1/x) do neither.
  bool oscillates_from(double zero, double distance) {
    constexpr int half = 6;
    constexpr double visible = 1e-2;  // of x′
    const double dt = std::fabs(to_.t - from_.t);
    const std::vector<std::vector<double>> F = before(zero, distance, 0.5, 2 * half + 1);
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

  /// The effect of an oscillation on xᵢ in the step that is still negligible: ten tolerances, and at most
  /// 10⁻⁶ of the size of x where the tolerance is loose.
  double hardly(std::size_t i) const {
    const auto k = static_cast<Eigen::Index>(i);
    const double rtol = tolerances_.rtol[k], several = std::min(10.0, 1e-6 / rtol);
    return several * (tolerances_.atol[k] + rtol * (std::fabs(from_.x[k]) + std::fabs(to_.x[k])));
  }

  /// F at distances before the zero that shrink by a constant factor.
  std::vector<std::vector<double>> before(double zero, double distance, double factor, int count) {
    std::vector<std::vector<double>> F(count, std::vector<double>(equations_.n() + equations_.m()));
    for (std::vector<double>& at : F) {
      value(zero - distance);
      if (equations_.is_ode())
        equations_.rhs(at.data());  // the residual contains x′, which near a pole would hide the growth
      else
        equations_.residual(at.data());
      distance *= factor;
    }
    return F;
  }

  /// Does the growth rate of disturbances approach k/distance in this direction? In steps of some 10⁻⁹ of the
  /// run rounding hides the interior, and the rate at the end of the step decides: a bounded rate has no
  /// effect in such a step.
  bool is_singular(int direction, double zero, double room, bool fine) {
    // of k; a bounded ∂x′/∂x gives a tenth of it at the closer point
    constexpr double slow = 0.1, constant = 3;
    const double far = fine ? 0.2 * room : room, close = 0.1 * far;
    const double k = growth(zero + direction * far, direction) * far;
    return k > slow && (!fine || growth(zero + direction * close, direction) * close > k / constant);
  }

  /// The largest Re λ of ±∂x′/∂x, in units of 1/step size.
  double growth(double share, int sign) {
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

  /// Sets the equations to the point at this share of the step and returns the factor there.
  double value(double share) {
    const double inside = std::max(share, 0.0);
    point_.t = from_.t + share * (to_.t - from_.t);
    point_.x = from_.x + share * (to_.x - from_.x) + offset_;
    point_.xdot = from_.xdot + inside * (to_.xdot - from_.xdot);
    point_.z = from_.z + inside * (to_.z - from_.z);
    equations_.set_point(point_.t, point_.x.data(), point_.xdot.data(), point_.z.data());
    double g = 0;
    factor_(equations_.values().data(), &g);
    return g;
  }
  Problem& equations_;
  const Tolerances& tolerances_;
  codegen::Kernel factor_;
  const Point &from_, &to_;
  Vec offset_;
  Point point_;
};

}  // namespace

DomainMonitor::DomainMonitor(const Problem& problem, const std::vector<Guard>& guards,
                             const Tolerances& tolerances, bool wanted)
    : tolerances_(tolerances) {
  if (!wanted) return;
  conditions_ = domain_conditions_of(problem);
  std::erase_if(conditions_, [&](const dae::DomainCondition& c) {
    return std::any_of(guards.begin(), guards.end(), [&](const Guard& g) { return g.factor == c.factor; });
  });
  if (conditions_.empty()) return;
  problem_ = std::make_shared<Problem>(problem);
  std::vector<Expr> factors, slopes;
  for (std::size_t i = 0; i < conditions_.size(); ++i) {
    if (!conditions_[i].pole) continue;
    const Expr factor = conditions_[i].factor, slope = total_derivative(factor);
    poles_.push_back({factor, i});
    factors.push_back(factor);
    slopes.push_back(all_known(slope, problem) ? slope : Expr(0));
  }
  for (Expr node : topological(factors))
    if (node.op() == Op::sin || node.op() == Op::cos) pieces_ = 8;
  factors.insert(factors.end(), slopes.begin(), slopes.end());
  if (!factors.empty()) kernel_ = codegen::Kernel(factors, problem.arguments());
}

void DomainMonitor::evaluate(codegen::Kernel& kernel, const Point& point) {
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  out_.resize(kernel.outputs());
  kernel(problem_->values().data(), out_.data());
}

void DomainMonitor::start(const Point& point) {
  if (conditions_.empty()) return;
  first_ = point;
  restart(point);
}

void DomainMonitor::restart(const Point& point) {
  if (poles_.empty()) return;
  evaluate(kernel_, point);
  for (std::size_t i = 0; i < poles_.size(); ++i) {
    poles_[i].g = out_[i];
    poles_[i].slope = out_[poles_.size() + i];
  }
}

std::optional<std::string> DomainMonitor::passed(Problem& equations, const Point& from, const Point& to) {
  if (poles_.empty()) return {};
  if (pieces_ == 1) return passed_part(equations, from, to);
  const std::vector<Pole> before = poles_;
  start_ = from;
  for (int k = 1; k <= pieces_; ++k) {
    inside_ = to;
    if (k < pieces_) hermite(from, to, static_cast<double>(k) / pieces_, inside_);
    if (auto reason = passed_part(equations, start_, inside_)) {
      poles_ = before;
      return reason;
    }
    std::swap(start_, inside_);
  }
  return {};
}

/// The sign has changed, or the value has grown although both slopes point towards zero.
bool DomainMonitor::suspicious(const Pole& pole, double g, double slope, double dt) const {
  if (pole.g == 0) return false;
  if (pole.g < 0 ? g >= 0 : g <= 0) return true;
  const double change = g - pole.g;
  const bool toward = pole.g * pole.slope < 0 && pole.g * slope < 0;
  return toward && change * pole.g > 0 && std::fabs(pole.slope) * dt > std::fabs(pole.g);
}

std::optional<std::string> DomainMonitor::passed_part(Problem& equations, const Point& from,
                                                      const Point& to) {
  evaluate(kernel_, to);
  const std::size_t n = poles_.size();
  const double dt = to.t - from.t;
  for (std::size_t i = 0; i < n; ++i) {
    Pole& pole = poles_[i];
    if (!suspicious(pole, out_[i], out_[n + i], dt)) continue;
    Point ahead = to;
    if (pole.g * out_[i] > 0) {  // extrapolated with the slope at the beginning
      const double share = -1.5 * pole.g / pole.slope;
      ahead.t = from.t + share;
      ahead.x = from.x + share * from.xdot;
    }
    PoleTest test(equations, pole.factor, tolerances_, from, ahead);
    if (test()) return conditions_[pole.condition].reason();
    const bool news = not_unique_.empty() && pole.g * out_[i] < 0;
    if (const auto t = news ? test.parting_time() : std::nullopt)
      not_unique_ = text("not unique from t = ", rounded(*t, 6), " on: ", to_text(pole.factor),
                         " = 0 there, and solutions may part without bound behind it; one of them is taken");
  }
  for (std::size_t i = 0; i < n; ++i) {
    poles_[i].slope = out_[n + i];
    if (out_[i] != 0) poles_[i].g = out_[i];
  }
  return {};
}

std::string DomainMonitor::almost_outside(const Point& point) {
  constexpr double gone = 1e-3;  // relative to the value at the start
  if (conditions_.empty() || first_.x.size() == 0) return "";
  std::vector<Expr> factors;
  for (const dae::DomainCondition& c : conditions_) factors.push_back(c.factor);
  codegen::Kernel all(factors, problem_->arguments());
  evaluate(all, first_);
  const std::vector<double> first = out_;
  evaluate(all, point);
  std::size_t closest = 0;
  double least = gone;
  for (std::size_t i = 0; i < conditions_.size(); ++i) {
    const double left = first[i] == 0 ? INFINITY : std::fabs(out_[i] / first[i]);
    if (!(left <= least)) continue;
    least = left;
    closest = i;
  }
  if (least >= gone) return "";
  std::string reason = conditions_[closest].reason();
  const double g = out_[closest];
  evaluate(all, a_moment_after(point));
  if (!(out_[closest] * g > 0)) return ". " + reason;
  const std::string zero = " = 0 there, and ";
  return ". " + reason.replace(reason.find(zero), zero.size(), " is almost 0 there; where it is 0, ");
}

}  // namespace pendula::integrate
