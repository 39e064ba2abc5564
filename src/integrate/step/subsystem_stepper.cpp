#include "integrate/step/subsystem_stepper.hpp"

#include <algorithm>

namespace pendula::integrate {

SubsystemStepper::SubsystemStepper(ProblemPtr problem, std::shared_ptr<const DependencyGraph> couplings,
                                   Make make, Tolerances tolerances, StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      couplings_(std::move(couplings)),
      make_(std::move(make)) {}

/// Continues with a part of `count` equations; `from` is a point of the whole model.
void SubsystemStepper::enter(int count, const Point& from, double dt, double end) {
  count_ = count;
  Subsystem part(*couplings_, problem_, rest_, order_, count);
  const Tolerances tolerances{part.take(tolerances_.rtol, n()), part.take(tolerances_.atol, n())};
  auto stepper = make_(part.problem, tolerances);
  stepper->suggest(dt);
  try {
    stepper->start(part.take(from), end);
  } catch (const Failure&) {  // a part may be singular where the whole is not
    if (part.whole) throw;
    return enter(couplings_->size(), from, dt, end);
  }
  stepper->suggest(0);
  uses_.push_back({std::move(part), std::move(stepper)});
}

void SubsystemStepper::start(const Point& point, double end) {
  constexpr int first = 500, ahead = 4;
  rest_ = point;
  int active = 0;
  order_ = couplings_->order(*problem_, point, active);
  enter(active > 0 ? std::max(first, ahead * active) : couplings_->size(), point, limits_.dt_first, end);
  here_ = point;
  uses_.back().part.put(inner().here(), here_);
  before_ = here_;
  dt_ = inner().next_dt();
}

void SubsystemStepper::step(double end) {
  for (;;) {
    bool failed = false;
    try {
      inner().step(end);
    } catch (const Failure&) {
      if (uses_.back().part.whole) throw;
      failed = true;
    }
    const Subsystem& part = uses_.back().part;
    if (!failed && !part.touched(inner().here(), rest_)) break;
    Point from = here_;
    const double dt = failed ? 0 : inner().here().t - from.t;
    if (!failed) --stats_.steps, ++stats_.rejected;
    enter(failed ? couplings_->size() : 4 * count_, from, dt, end);
  }
  const Use& use = uses_.back();
  use.part.put(inner().before(), before_);
  use.part.put(inner().here(), here_);
  dt_ = inner().next_dt();
}

void SubsystemStepper::record(double* to) const {
  *to = static_cast<double>(uses_.size() - 1);
  inner().record(to + 1);
}

StepView SubsystemStepper::view(const Use& use, const StepView& step) const {
  return {use.part.take(step.from), use.part.take(step.to), step.record + 1};
}

Detail SubsystemStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  const Use& use = uses_[step.record[0]];
  Point some;
  use.stepper->interpolate(view(use, step), t, detail, some);
  out = step.to;
  if (some.xdot.size() == 0) some.xdot = use.part.take(step.to).xdot;
  if (some.z.size() == 0) some.z = use.part.take(step.to).z;
  use.part.put(some, out);
  return detail;
}

TableauPtr SubsystemStepper::tableau(const StepView& step) const {
  const Use& use = uses_[step.record[0]];
  return use.stepper->tableau(view(use, step));
}

}  // namespace pendula::integrate
