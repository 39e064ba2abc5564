// Which branch of piecewise equations is in force, from one crossing to the next (event/surfaces.hpp), and
// where branches are no longer frozen.
//
// A border is thawed, that is its branches are evaluated as they are written from then on, and no crossing is
// looked for, where freezing it does more harm than good:
//
//   - the solution goes on on neither side, or crosses it infinitely often: two voltages that become equal
//   - crossings follow each other within two steps, six times, or make up a quarter of all steps: locating
//     costs more than a kink inside a step
//   - a step fails: a frozen branch has been evaluated far outside its own domain
//
// and only if the equations are continuous there: by their expressions, or at the point (border_jump.hpp).
#pragma once

#include <memory>
#include <vector>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/adaptive_state.hpp"
#include "integrate/run/border_jump.hpp"
#include "integrate/run/method_selector.hpp"

namespace pendula::integrate {

class ModeTracker {
 public:
  using Crossings = std::vector<EventFinder::Crossing>;

  /// Requires that both outlive it.
  ModeTracker(AdaptiveState& state, MethodSelector& method);

  /// The modes at the start of the run, before there is a stepper.
  void initialise(const Point& point);
  /// Stepper and events begin at a point, in the modes of the side on which the solution goes on; crossed:
  /// where it comes from a root. Throws Failure where the solution can go on on no side (sliding).
  void begin(const Point& point, const Crossings& crossed);
  /// After a step without events: a crossing was missed, or the solution has left a surface it was on.
  bool differ() const;
  /// Counts the crossings; thaws borders that are crossed too often. The run must begin again afterwards.
  void count(const Crossings& crossed, const Point& point);
  /// Thaws those of the borders among the crossings that can be; false if there are none.
  bool thaw(const Crossings& crossed, const Point& point);
  /// After a failure of a step: all on which the equations are known to be continuous.
  bool thaw_all(const Point& point);
  /// True where the equations are continuous at every crossing.
  bool is_continuous(const Crossings& crossed) const;
  /// Writes into the solution what became of every border.
  void report() const;

  /// Why a run ends that slides along a surface.
  static Failure sliding(const Event& surface);

 private:
  struct Border {
    long crossings = 0, last_step = -1000, quick = 0;
    bool thawed = false;
    double thawed_at = 0;
  };
  const std::vector<Event>& events() const { return state_.plan.events.list; }
  bool try_modes(const Point& point, const Crossings& crossed, std::vector<int>& changed);
  std::vector<int> set_modes(const Point& point, const Crossings& crossed);
  void use(const std::vector<double>& sides);
  double side_ahead(int which, const Point& point);
  bool thaw_one(int which, const Point& point);
  void use_thawed();

  AdaptiveState& state_;
  MethodSelector& method_;
  BorderJump jump_;
  std::vector<double> modes_;
  std::vector<Border> borders_;  ///< of every event
  long crossings_ = 0;           ///< of borders that can be thawed, at different times
  std::unique_ptr<RhsSolver> derivative_;
};

}  // namespace pendula::integrate
