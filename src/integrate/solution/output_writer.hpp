// Writes points into a solution: every mesh point, or the requested times.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "integrate/solution/solution.hpp"

namespace pendula::integrate {

class OutputWriter {
 public:
  /// times: those requested, ascending; none: every mesh point. Requires that solution and times outlive it.
  OutputWriter(Solution& solution, const std::optional<std::vector<double>>& times, double from, double to)
      : solution_(solution),
        times_(times),
        rounding_(4 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(from), std::fabs(to))) {}

  /// A point without a step to it: the beginning, or after a jump.
  void begin(const Point& point) {
    held_.reset();
    if (!times_) return solution_.save(point);
    if (wants(point.t)) save(point);
  }

  /// begin() where a step ended that was announced as about to jump: one point at
  /// this time if nothing has jumped.
  void go_on(const Point& point, bool has_jumped) {
    if (times_ || has_jumped) begin(point);
  }

  /// The run ends: no point comes that has the time of the last step's end.
  void release() {
    if (held_) begin(Point(*held_));
  }

  /// What was saved behind t is taken back.
  void rewind(double t) {
    if (held_ && held_->t > t) held_.reset();
    while (times_ && next_ > 0 && (*times_)[next_ - 1] > t + rounding_) --next_;
  }

  /// Is there a requested time up to t that has no point yet?
  bool wants(double t) const { return times_ && next_ < times_->size() && (*times_)[next_] <= t + rounding_; }

  /// The end of a step. between(t, point): the solution inside the step. about_to_jump: the time of the end
  /// belongs to the point after the jump, which begin() or go_on() will bring.
  template <class Between>
  void step(const Point& end, bool about_to_jump, const Between& between) {
    if (!times_) return solution_.save(end);
    while (wants(end.t)) {
      const double t = (*times_)[next_];
      const bool at_end = t >= end.t - rounding_;
      if (at_end && about_to_jump) {
        held_ = end;
        return;
      }
      if (at_end) {
        save(end);
        continue;
      }
      between(t, between_);
      save(between_);
    }
  }

 private:
  void save(const Point& point) {
    requested_ = point;
    requested_.t = (*times_)[next_++];  // the time as it was asked for
    solution_.save(requested_);
  }
  Solution& solution_;
  const std::optional<std::vector<double>>& times_;
  double rounding_;
  std::size_t next_ = 0;
  Point between_, requested_;
  std::optional<Point> held_;  ///< the end of a step, before what happens there
};

}  // namespace pendula::integrate
