// Runs that almost stand still before they move: errors within the tolerances have
// decided in which direction.
//
// Where x′ = f(x), at its present speed, moves the solution by less than 1000 tolerances until the end, an
// error of one tolerance shifts it in time by more than a thousandth of the rest (x′ satisfies the
// equation of an error, δ′ = f_x δ). If the solution then moves 1000 times as far, the errors have been
// magnified: Robertson's problem with too large an atol (HW §IV.10) passes a = 0, where a′ ≈ -5·10⁻⁴ a²,
// and leaves it on the other side. Only for equations without t. The bounds were chosen on that problem
// and on logistic growth from below atol.
#pragma once

#include <optional>
#include <vector>

#include "integrate/event/events.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class Standstill {
 public:
  Standstill(const Problem& problem, const Tolerances& tolerances, const std::vector<Event>& events);

  /// At the start, and after every accepted step: where it ends, and the time that is left.
  void after(const Point& point, double left);
  /// The time at which the solution almost stood still, if it has moved since.
  std::optional<double> rest(const Point& end) const;

 private:
  static constexpr double slow = 1000;
  bool autonomous_;
  Tolerances tolerances_;
  Vec largest_;
  struct Slowest {
    double distance = slow, t = 0;  ///< in tolerances, at that speed until the end
    Vec x;                          ///< empty: there was none
  };
  Slowest slowest_;             ///< the slowest point so far
  std::optional<double> rest_;  ///< of an earlier one
};

}  // namespace pendula::integrate
