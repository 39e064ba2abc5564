#include "integrate/event/monitor/domain_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/event/monitor/pole_test.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

DomainMonitor::DomainMonitor(const Problem& problem, const std::vector<Guard>& guards,
                             const Tolerances& tolerances, bool determined, bool wanted)
    : tolerances_(tolerances), determined_(determined) {
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
  begin_at(point);
}

void DomainMonitor::restart(const ProblemPtr&, const Point& point) { begin_at(point); }

void DomainMonitor::begin_at(const Point& point) {
  if (poles_.empty()) return;
  evaluate(kernel_, point);
  for (std::size_t i = 0; i < poles_.size(); ++i) {
    poles_[i].g = out_[i];
    poles_[i].slope = out_[poles_.size() + i];
  }
}

std::optional<Rejection> DomainMonitor::after(const ProblemPtr& problem, const Point& from, const Point& to) {
  if (poles_.empty()) return {};
  if (pieces_ == 1) return passed_part(problem, from, to);
  const std::vector<Pole> before = poles_;
  start_ = from;
  for (int k = 1; k <= pieces_; ++k) {
    inside_ = to;
    if (k < pieces_) hermite(from, to, static_cast<double>(k) / pieces_, inside_);
    if (auto rejection = passed_part(problem, start_, inside_)) {
      poles_ = before;
      return rejection;
    }
    std::swap(start_, inside_);
  }
  return {};
}

/// Passed: the sign has changed, or the value has grown although both slopes point towards zero. Touched:
/// almost 0 at one end, compared with the other, where stages come close to it.
DomainMonitor::Suspicion DomainMonitor::suspicion(const Pole& pole, double g, double slope, double dt) const {
  constexpr double almost = 1e-3;  // 1/√g grows by 30, and a step that follows it is much shorter
  if (pole.g == 0) return Suspicion::none;
  if (pole.g < 0 ? g >= 0 : g <= 0) return Suspicion::passed;
  const double change = g - pole.g;
  const bool toward = pole.g * pole.slope < 0 && pole.g * slope < 0;
  if (toward && change * pole.g > 0 && std::fabs(pole.slope) * dt > std::fabs(pole.g))
    return Suspicion::passed;
  const auto [small, large] = std::minmax({std::fabs(g), std::fabs(pole.g)});
  return small < almost * large ? Suspicion::touched : Suspicion::none;
}

/// The point of the line through two others beyond the second by this share of their distance, or, where it
/// is below 0, before the first.
static Point extended(const Point& from, const Point& to, double share) {
  Point point = share < 0 ? from : to;
  point.t += share * (to.t - from.t);
  point.x += share * (to.x - from.x);
  return point;
}

std::optional<Rejection> DomainMonitor::look(const Pole& pole, Suspicion kind, double g,
                                             const ProblemPtr& equations, const Point& from,
                                             const Point& to) {
  constexpr double several = 3;  // tolerances: the admissible error of a step, as in peak_monitor
  if (kind == Suspicion::touched) {
    constexpr double beyond = 0.01;  // of the step: a g of 10⁻³ becomes 0 within 10⁻³ of it
    const Point before = extended(from, to, -beyond), after = extended(from, to, beyond);
    PoleTest test(equations, determined_, pole.factor, tolerances_, before, after);
    const double error = test.integrable_error();
    return error > several ? std::optional(Rejection{.error = error}) : std::nullopt;
  }
  Point ahead = to;
  if (pole.g * g > 0) {  // extrapolated with the slope at the beginning
    const double share = -1.5 * pole.g / pole.slope;
    ahead.t = from.t + share;
    ahead.x = from.x + share * from.xdot;
  }
  PoleTest test(equations, determined_, pole.factor, tolerances_, from, ahead);
  const PoleTest::Crossing crossing = test.crossing();
  if (test.is_pole() || crossing == PoleTest::Crossing::jumped)
    return Rejection{.reason = conditions_[pole.condition].reason()};
  if (const double error = test.integrable_error(); error > several) return Rejection{.error = error};
  const bool news = not_unique_.empty() && pole.g * g < 0;
  if (news && crossing == PoleTest::Crossing::impossible)
    not_unique_ = text("decided by errors from t = ", rounded(to.t, 6), " on: ", to_text(pole.factor),
                       " has changed its sign, which no solution does, since it is at rest at 0");
  else if (const auto t = news ? test.parting_time() : std::nullopt)
    not_unique_ = text("not unique from t = ", rounded(*t, 6), " on: ", to_text(pole.factor),
                       " = 0 there, and solutions may part without bound behind it; one of them is taken");
  return {};
}

std::optional<Rejection> DomainMonitor::passed_part(const ProblemPtr& equations, const Point& from,
                                                    const Point& to) {
  evaluate(kernel_, to);
  const std::size_t n = poles_.size();
  const double dt = to.t - from.t;
  for (std::size_t i = 0; i < n; ++i) {
    const Suspicion kind = suspicion(poles_[i], out_[i], out_[n + i], dt);
    if (kind == Suspicion::none) continue;
    if (auto found = look(poles_[i], kind, out_[i], equations, from, to)) return found;
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
