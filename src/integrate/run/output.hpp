// Parts of the adaptive driver: which points are kept, and when restarts come to no end.
#pragma once

#include <deque>
#include <limits>

#include "integrate/run/fixed_step_run.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

/// Saves mesh points, or the requested times.
class Saver {
 public:
  Saver(Solution& solution, const Plan& plan)
      : solution_(solution),
        plan_(plan),
        rounding_(4 * std::numeric_limits<double>::epsilon() *
                  std::max(std::fabs(plan.from), std::fabs(plan.to))) {}

  void begin(const Point& point) {
    if (!plan_.times) return solution_.save(point);
    if (next_ < plan_.times->size() && (*plan_.times)[next_] <= point.t + rounding_) save(point);
  }
  /// Is there a requested time before t?
  bool wants(double t) const {
    return plan_.times && next_ < plan_.times->size() && (*plan_.times)[next_] <= t + rounding_;
  }
  /// `open`: the end of the step is about to jump, its time belongs to the point after.
  void step(Stepper& stepper, const StepView& view, const Point& end, bool open) {
    if (!plan_.times) return solution_.save(end);
    for (; next_ < plan_.times->size();) {
      const double t = (*plan_.times)[next_];
      if (t > end.t + rounding_ || (open && t >= end.t - rounding_)) return;
      if (t >= end.t - rounding_) {
        save(end);
        continue;
      }
      stepper.interpolate(view, t, Detail::full, between_);
      save(between_);
    }
  }

 private:
  void save(const Point& point) {
    asked_ = point;
    asked_.t = (*plan_.times)[next_++];  // the time as it was asked for
    solution_.save(asked_);
  }
  Solution& solution_;
  const Plan& plan_;
  double rounding_;
  std::size_t next_ = 0;
  Point between_, asked_;
};

/// Restarts that follow each other at shrinking distances: no time passes any more.
class Accumulation {
 public:
  /// True when there is no end of it. `steps`: taken so far.
  bool add(double t, long steps, double span) {
    quick_ = steps - last_steps_ <= 2 ? quick_ + 1 : 0;
    last_steps_ = steps;
    if (quick_ == 0) since_ = t;
    if (quick_ >= 40 && t - since_ < 1e-4 * span) return true;
    times_.push_back(t);
    if (times_.size() <= many) return false;
    times_.pop_front();
    return times_.back() - times_.front() < 1e-8 * span;
  }

 private:
  static constexpr std::size_t many = 12;
  std::deque<double> times_;
  int quick_ = 0;
  long last_steps_ = 0;
  double since_ = 0;
};

}  // namespace pendula::integrate
