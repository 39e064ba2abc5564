// Whether the equations jump across a border at a point where a solution has come to it.
#pragma once

#include <map>
#include <memory>

#include "codegen/kernel/kernel.hpp"
#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

/// F with its branches as they are written, on both sides of the border at distances δ: with a jump,
/// F(p + δn) - F(p - δn) does not shrink with δ; without, it is of the size of δ, or of √δ at the worst. n is
/// the gradient of the surface function, each unknown in units of its size.
class BorderJump {
 public:
  /// Requires that the state outlives it.
  explicit BorderJump(AdaptiveState& state) : state_(state) {}
  /// Is F continuous across the surface of this event at this point?
  bool is_continuous(int event, const Point& point);

 private:
  /// The derivatives of the surface function with respect to t, x, x′, z, and the function.
  struct Direction {
    codegen::Kernel kernel;
    std::vector<double> numbers;
  };
  Vec direction(int event, const Point& point);
  static Point moved(const Point& point, const Vec& by);
  double condition(int event, const Point& point);
  Vec difference(const Point& point, const Vec& direction, double distance);
  Vec rounding(const Point& point);

  AdaptiveState& state_;
  ProblemPtr live_;
  std::map<int, Direction> directions_;
};

}  // namespace pendula::integrate
