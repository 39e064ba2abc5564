// Steps that are alike: many of them behind say that many such are to come.
#pragma once

#include <algorithm>

namespace pendula::integrate {

/// Counts the last steps in a row whose sizes differ by a factor of at most 5. In a relaxation oscillation, a
/// transient, or near a singular point they differ by more.
class SteadySteps {
 public:
  void add(double dt) {
    constexpr double unlike = 5;
    shortest_ = std::min(shortest_, dt);
    longest_ = std::max(longest_, dt);
    if (count_ == 0 || longest_ > unlike * shortest_) {
      count_ = 0;
      time_ = 0;
      shortest_ = longest_ = dt;
    }
    ++count_;
    time_ += dt;
  }
  void begin() { count_ = 0; }
  long count() const { return count_; }
  double mean() const { return time_ / static_cast<double>(count_); }

 private:
  long count_ = 0;
  double time_ = 0, shortest_ = 0, longest_ = 0;
};

}  // namespace pendula::integrate
