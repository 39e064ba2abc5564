// State shared by the parts of an adaptive run: its position, and its results so far.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "integrate/event/events.hpp"
#include "integrate/plan/plan.hpp"
#include "integrate/solution/output_writer.hpp"
#include "integrate/solution/step_history.hpp"

namespace pendula::integrate {

struct AdaptiveState {
  AdaptiveState(ProblemPtr given, const Plan& asked);
  AdaptiveState(const AdaptiveState&) = delete;
  AdaptiveState& operator=(const AdaptiveState&) = delete;

  Stepper& stepper() { return history->stepper(); }
  Stats& stats() { return history->stats; }
  double interval() const { return plan.to - plan.from; }

  /// The next step ends at `to` or where inputs are not smooth.
  void set_step_end(double t);
  /// Inputs jump at this time: steps end there, and until then inputs have the values before it.
  void limit(double t);
  /// Another problem with the same unknowns takes over; the next stepper is made for it.
  void use(ProblemPtr other);
  /// The stepper's last step, for the continuous extension; its ends only where somebody asks.
  void view_step();
  /// The step, or its part up to an event, belongs to the solution. about_to_jump: see OutputWriter.
  void keep(const Point& end, bool about_to_jump);
  /// The stepper was restarted at the end of the last step, which was announced as about to jump.
  void go_on(const Point& before);
  /// The point inside the last step. z of index 1 is solved for.
  Point inside(double t, Detail detail);

  ProblemPtr problem;
  Plan plan;
  std::shared_ptr<StepHistory> history;
  std::shared_ptr<Solution> solution;
  OutputWriter writer;
  EventFinder finder;
  StepView view;
  double reached = 0;  ///< the solution ends here so far
  double end = 0;      ///< of the next step at the latest

 private:
  /// Do z or x′ differ by more than their errors?
  bool jumps(const Point& before, const Point& after) const;

  std::vector<double> record_;
  double limit_ = std::numeric_limits<double>::infinity();
};

}  // namespace pendula::integrate
