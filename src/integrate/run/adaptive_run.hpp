// The driver of every method that chooses its steps: times, events, dense output, statistics, interruption.
#pragma once

#include "integrate/plan/plan.hpp"
#include "integrate/solution/solution.hpp"

namespace pendula::integrate {

/// Integrates with error control. start: x is taken as it is, x′ and z are starting values.
///
/// "auto" begins with an explicit method where x′ and z follow from (t, x) and changes to Radau IIA when the
/// step size turns out to be limited by stability; the name of the solution's method says so.
///
/// returns   the solution; when the step size vanishes, most_steps are used up or Ctrl-C is pressed, the part
///           computed so far, and status() says why and where
/// throws    Error on a bad plan or a method that cannot treat the model; Failure when the start determines
///           no x′ and z; what an input function or an event callback throws
SolutionPtr integrate_adaptive(ProblemPtr problem, const Method& method, Point start, const Plan& plan,
                               const std::function<void(SolutionPtr)>& watch = {});

/// Denormal numbers are zero while this lives (this thread): quiet components of large systems
/// decay into them, and arithmetic with them is up to 100 times slower. What a callback
/// computes is not affected: see Normal.
class FlushDenormals {
 public:
  FlushDenormals();
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned before_;
};

}  // namespace pendula::integrate
