// Detects events that accumulate: infinitely many in finite time (Zeno's paradox), as of a bouncing ball.
#pragma once

#include <deque>

namespace pendula::integrate {

class ZenoDetector {
 public:
  /// An event at time t, after so many steps of a run over so long an interval. True when events have
  /// accumulated: 12 within 10⁻⁸ of the interval, or 40 in a row without more than two steps between them
  /// within 10⁻⁴ of it. (The distances of a geometric sequence with ratio 0.9 fall by 10⁻² in 40 events: the
  /// second test sees it while the first waits for the distances to become invisible.)
  bool add(double t, long steps, double interval) {
    close_events_ = steps - last_steps_ <= 2 ? close_events_ + 1 : 0;
    last_steps_ = steps;
    if (close_events_ == 0) since_ = t;
    if (close_events_ >= 40 && t - since_ < 1e-4 * interval) return true;
    times_.push_back(t);
    if (times_.size() <= many) return false;
    times_.pop_front();
    return times_.back() - times_.front() < 1e-8 * interval;
  }

 private:
  static constexpr std::size_t many = 12;
  std::deque<double> times_;
  int close_events_ = 0;
  long last_steps_ = 0;
  double since_ = 0;
};

}  // namespace pendula::integrate
