// Which branch of piecewise equations is in force, from one crossing to the next (event/surfaces.hpp).
#pragma once

#include <memory>
#include <vector>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

class ModeTracker {
 public:
  using Crossings = std::vector<EventFinder::Crossing>;

  /// Requires that the state outlives it.
  explicit ModeTracker(AdaptiveState& state) : state_(state) {}

  /// The modes at the start of the run, before there is a stepper.
  void initialise(const Point& point);
  /// Stepper and events begin at a point, in the modes of the side on which the solution goes on; crossed:
  /// where it comes from a root. Throws Failure where the solution can go on on no side (sliding).
  void begin(const Point& point, const Crossings& crossed);
  /// After a step without events: a crossing was missed, or the solution has left a surface it was on.
  bool differ() const;

  /// Why a run ends that slides along a surface.
  static Failure sliding(const Event& surface);

 private:
  const std::vector<Event>& events() const { return state_.plan.events.list; }
  int set_modes(const Point& point, const Crossings& crossed);
  void use(const std::vector<double>& sides);
  double side_ahead(int which, const Point& point);

  AdaptiveState& state_;
  std::vector<double> modes_;
  std::unique_ptr<RhsSolver> derivative_;
};

}  // namespace pendula::integrate
