#include "integrate/events.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "expr/derivative.hpp"

namespace pendula::integrate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr int pieces = 4;  // a step is looked at in so many places

bool opposite(double a, double b) { return (a < 0 && b > 0) || (a > 0 && b < 0); }

}  // namespace

std::vector<Expr> switching_surfaces(std::span<const Expr> F) {
  std::vector<Expr> result;
  std::unordered_set<Expr> seen;
  const auto add = [&](Expr e) {
    if (!e.is_constant() && seen.insert(e).second && seen.insert(-e).second) result.push_back(e);
  };
  for (Expr node : topological(F)) {
    switch (node.op()) {
      case Op::abs:
      case Op::sign:
        add(node.operand(0));
        break;
      case Op::min:
      case Op::max:
      case Op::lt:
      case Op::le:
        add(node.operand(0) - node.operand(1));
        break;
      default:
        break;
    }
  }
  return result;
}

EventFinder::EventFinder(const ProblemPtr& problem, const std::vector<Event>& events)
    : problem_(std::make_shared<Problem>(*problem)), events_(events) {
  if (events.empty()) return;
  const dae::FirstOrder& model = problem->model();
  const std::vector<Expr>& arguments = problem->arguments();
  const std::unordered_set<Expr> known(arguments.begin(), arguments.end());
  std::vector<Expr> outputs, slopes;
  std::unordered_set<Expr> late(model.xdot.begin(), model.xdot.end());
  late.insert(model.z.begin(), model.z.end());
  for (Expr x : model.x) late.erase(x);
  for (const Event& event : events) {
    outputs.push_back(event.when);
    const Expr slope = total_derivative(event.when);
    const std::vector<Expr> inside = leaves({&slope, 1});
    const bool usable = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return known.count(leaf) || symbol_of(leaf).kind == Kind::constant;
    });
    slope_known_.push_back(usable);
    slopes.push_back(usable ? slope : Expr());
    for (Expr leaf : leaves({&event.when, 1})) needs_derivatives_ = needs_derivatives_ || late.count(leaf);
  }
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  for (Expr leaf : leaves(slopes)) needs_derivatives_ = needs_derivatives_ || late.count(leaf);
  kernel_ = codegen::Kernel(outputs, arguments);
  out_.resize(outputs.size());
  samples_.resize(pieces);
}

void EventFinder::evaluate(const Point& point, Sample& out) {
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  const auto middle = out_.begin() + static_cast<std::ptrdiff_t>(events_.size());
  out.t = point.t;
  out.g.assign(out_.begin(), middle);
  out.slope.assign(middle, out_.end());
}

void EventFinder::sample(Stepper& stepper, const StepView& step, double t, Detail detail, Sample& out) {
  if (t >= step.to.t) return evaluate(step.to, out);
  point_.xdot = step.to.xdot, point_.z = step.to.z;
  if (detail == Detail::state && needs_derivatives_) detail = Detail::full;
  stepper.interpolate(step, t, detail, point_);
  evaluate(point_, out);
}

double EventFinder::value(Stepper& stepper, const StepView& step, int which, double t) {
  sample(stepper, step, t, Detail::state, probe_);
  return probe_.g[static_cast<std::size_t>(which)];
}

/// A zero at the beginning becomes the sign of g just after it.
void EventFinder::start(const Point& point) {
  if (events_.empty()) return;
  evaluate(point, last_);
  for (std::size_t i = 0; i < events_.size(); ++i) {
    double size = 0;  // of g where it is not zero: one unit of time on
    if (slope_known_[i]) size = std::fabs(last_.slope[i]) * std::max(1.0, std::fabs(point.t));
    if (std::fabs(last_.g[i]) > 64 * eps * size && last_.g[i] != 0) continue;
    last_.g[i] =
        std::copysign(last_.slope[i] == 0 ? 0.0 : std::numeric_limits<double>::min(), last_.slope[i]);
  }
}

/// Illinois-safeguarded secant between points of opposite sign; the end where the sign has changed.
EventFinder::Root EventFinder::locate(Stepper& stepper, const StepView& step, int which, double a, double ga,
                                      double b, double gb) {
  int side = 0;
  for (int k = 0; k < 200; ++k) {
    const double smallest = 2 * eps * std::max(std::fabs(a), std::fabs(b));
    if (b - a <= smallest || gb == 0) break;
    double t = k % 4 == 3 ? (a + b) / 2 : b - gb * (b - a) / (gb - ga);
    t = std::clamp(t, a + smallest / 2, b - smallest / 2);
    const double g = value(stepper, step, which, t);
    if (g == 0) return {a, t};
    if (opposite(g, gb)) {
      a = t, ga = g;
      if (side == -1) gb /= 2;
      side = -1;
    } else {
      b = t, gb = g;
      if (side == 1) ga /= 2;
      side = 1;
    }
  }
  return {a, b};
}

/// Where g touches or crosses zero between two samples of one sign, by the sign of its slope.
std::optional<double> EventFinder::dip(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                       const Sample& b) {
  const auto i = static_cast<std::size_t>(which);
  const double sign = b.g[i] > 0 ? 1 : -1;
  double low = a.t, high = b.t;
  for (int k = 0; k < 40 && high - low > 4 * eps * std::max(std::fabs(low), std::fabs(high)); ++k) {
    const double t = (low + high) / 2;
    const double g = value(stepper, step, which, t);
    if (g * sign < 0) return t;
    (probe_.slope[i] * sign < 0 ? low : high) = t;
  }
  return {};
}

std::optional<EventFinder::Root> EventFinder::root_between(Stepper& stepper, const StepView& step, int which,
                                                           const Sample& a, const Sample& b) {
  const auto i = static_cast<std::size_t>(which);
  double left = a.t, ga = a.g[i], right = b.t, gb = b.g[i];
  if (gb == 0 && right >= step.to.t) return ga != 0 ? std::optional(Root{b.t, b.t}) : std::nullopt;
  if (!opposite(ga, gb)) {
    const bool toward = slope_known_[i] && a.slope[i] * gb < 0 && b.slope[i] * gb > 0 && ga != 0;
    const auto bottom = toward ? dip(stepper, step, which, a, b) : std::nullopt;
    if (!bottom) return {};
    right = *bottom;
    gb = value(stepper, step, which, right);
  } else if (right < step.to.t) {  // what the sketch has seen must be so
    gb = value(stepper, step, which, right);
    if (!opposite(ga, gb)) return {};
  }
  // `a` may be a root itself: step back towards it until its sign just after is seen.
  double t = left;
  for (int k = 0; std::fabs(ga) <= std::numeric_limits<double>::min(); ++k) {
    if (k == 48) return {};
    t = left + (right - left) / 2;
    const double g = value(stepper, step, which, t);
    if (opposite(g, gb)) {
      left = t, ga = g;
    } else {
      right = t, gb = g;
    }
  }
  return locate(stepper, step, which, left, ga, right, gb);
}

std::optional<EventFinder::Hit> EventFinder::first_hit(Stepper& stepper, const StepView& step,
                                                       const Sample& a, const Sample& b) {
  std::optional<Hit> first;
  for (int i = 0; i < static_cast<int>(events_.size()); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!(std::isfinite(a.g[k]) && std::isfinite(b.g[k]))) continue;
    const std::optional<Root> root = root_between(stepper, step, i, a, b);
    if (!root || (first && root->t >= first->t)) continue;
    const bool rising = a.g[k] < 0;
    if (events_[k].direction != 0 && (events_[k].direction > 0) != rising) continue;
    first = Hit{root->t, root->before, i, rising};
  }
  return first;
}

std::optional<EventFinder::Hit> EventFinder::find(Stepper& stepper, const StepView& step) {
  if (events_.empty()) return {};
  const double from = last_.t, length = step.to.t - from;
  for (int k = 1; k <= pieces; ++k) {
    Sample& here = samples_[static_cast<std::size_t>(k - 1)];
    sample(stepper, step, k == pieces ? step.to.t : from + length * k / pieces, Detail::sketch, here);
    if (const auto hit = first_hit(stepper, step, last_, here)) return hit;
    for (std::size_t i = 0; i < events_.size(); ++i)
      if (here.g[i] == 0)
        here.g[i] = last_.g[i] == 0 ? 0.0 : std::copysign(std::numeric_limits<double>::min(), here.slope[i]);
    std::swap(last_, here);
  }
  return {};
}

void EventFinder::pass(const Hit& hit, Stepper& stepper, const StepView& step) {
  sample(stepper, step, hit.t, Detail::state, last_);
  last_.g[static_cast<std::size_t>(hit.which)] =
      std::copysign(std::numeric_limits<double>::min(), hit.rising ? 1.0 : -1.0);
}

}  // namespace pendula::integrate
