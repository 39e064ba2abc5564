// What the errors of the steps become until the end of a run.
//
// Along a solution of x′ = f(x) the equation of an error, δ′ = f_x δ, has a solution that costs nothing: δ = x′, since
// (x′)′ = f_x x′. An error e at t in the direction of x′(t) is a shift of time by e/|x′(t)|, and
// e |x′(T)|/|x′(t)| at T: large where a run has come close to an equilibrium and leaves it again. Resets do not change
// the shift.
//
// Where the solution would move by less than 1000 tolerances until the end, an error of one tolerance there is a shift of
// more than a thousandth of the time that is left. If it moves 1000 times as far as that all the same, errors within the
// tolerances have decided where to: Robertson's problem with too large an atol (HW §IV.10) passes a = 0, where
// a′ ≈ -5·10⁻⁴ a², and leaves it on the other side.
//
// A lower bound of what an error can become: those across the solution may grow faster. Without t in the equations only.
#pragma once

#include <optional>
#include <vector>

#include "integrate/event/events.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class CarriedErrors {
 public:
  CarriedErrors(const Problem& problem, const Tolerances& tolerances, const std::vector<Event>& events);

  /// At the start, and after every accepted step: where it ends, the sum of the errors so far, in tolerances, and the time that is left.
  void after(const Point& point, double errors, double left);
  /// At the end of a run of so much time, in tolerances of the largest values so far; 0 where it is not known.
  double at(const Point& end, double time) const;
  /// The time at which the solution almost stood still, if it has moved since.
  std::optional<double> rest(const Point& end) const;

 private:
  static constexpr double slow = 1000;
  bool autonomous_;
  Tolerances tolerances_;
  Vec largest_;
  double errors_ = 0;  ///< so far
  double shift_ = 0;   ///< of time, that they amount to
  struct Still {
    double way = slow, t = 0;  ///< in tolerances, at that speed until the end
    Vec x;                     ///< empty: there was none
  };
  Still still_;                 ///< the slowest point so far
  std::optional<double> rest_;  ///< of an earlier one
};

}  // namespace pendula::integrate
