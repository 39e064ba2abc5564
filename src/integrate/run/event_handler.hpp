// Actions at an event of an adaptive run: callbacks, resets, restarts, the end of the run.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "integrate/event/at_roots.hpp"
#include "integrate/event/zeno_detector.hpp"
#include "integrate/plan/run_monitors.hpp"
#include "integrate/run/mode_tracker.hpp"

namespace pendula::integrate {

// Of the interval. A run that stops again after less than `brief` is stuck (as in StallDetector), and a step
// as short is not repeated. Repeated steps are longer than 17 quarterings of all of it. `no_time`: rounding.
constexpr double brief = 1e-6, shortest_repeated = 1e-10, no_time = 1e-12;

class EventHandler {
 public:
  /// Requires that all of them outlive it.
  EventHandler(AdaptiveState& state, ModeTracker& modes, MonitorList& monitors)
      : state_(state), modes_(modes), monitors_(monitors) {}

  /// All events of the step that has just been taken, in the order of time. True: the step is over, because
  /// it ended at an event or was taken back; `outcome` is set if the run is over, too.
  bool after_step(RunOutcome& outcome);

  /// After a start or a restart: applies, one after the other, events whose condition is beyond its root
  /// already where that counts (dae::Direction), and events whose condition a reset sends across its root.
  /// True where one of them ends the run. Throws Failure where they trigger each other without end. before:
  /// the point before the last reset, if there was one; pending: events that were found at the same moment,
  /// which come first.
  bool settle(const Point* before = nullptr, std::vector<EventFinder::Crossing> pending = {});

  /// Restarts at a point where the equations or the states have jumped.
  void begin_again(const Point& point, const ModeTracker::Crossings& crossed);

  /// On which side of its root each condition is: -1, 0, 1.
  std::vector<double> sides() const;
  /// Of sides before a jump: conditions that it has carried across their roots, beside those of a hit.
  std::vector<EventFinder::Crossing> carried_across(const std::vector<double>& before,
                                                    const EventFinder::Hit& hit = {}) const;
  /// After begin_again(): as settle(), for conditions that the jump has carried across their roots. Requires
  /// the point and the sides before the jump.
  bool settle_carried(const Point& before, const std::vector<double>& sides);

  /// The step is taken back, and the next one ends at t. False where that makes no progress.
  bool repeated_until(double t);

  /// The step is taken back and repeated with a quarter of its length. False where that makes no progress, or
  /// where x′ and z, solved for again, are on another branch: the step has passed the singular point already.
  bool repeated_shorter();
  bool repeated_for_doubt();

 private:
  const Event& event_of(const EventFinder::Crossing& crossing) const {
    return state_.plan.events.list[crossing.which];
  }
  /// The equations have finite values there.
  bool is_defined(const Point& point) const;
  bool begins_on_chosen_side();
  bool repeated_up_to(double t);
  bool repeated(double dt);
  bool handle(const EventFinder::Hit& hit, RunOutcome& outcome);
  Point point_of(const EventFinder::Hit& hit, bool before);
  bool drop_jumps(EventFinder::Hit& hit);
  const Event* terminating(const EventFinder::Hit& hit) const;
  bool end_before(const EventFinder::Hit& hit, const Event& event, RunOutcome& outcome);
  bool is_contradictory(const EventFinder::Hit& hit, const Point& point);
  Failure accumulation(const Event& event) const;

  AtRoots at_roots(const Point& before, const Point& here);
  bool is_at_root(std::size_t i, const Point& point, double fastest) const;
  std::optional<int> overdue(const std::vector<char>& happened, const std::vector<char>& idle,
                             const AtRoots* roots, const Point& here);
  void remark_order(int which, double t);
  bool is_thrown_back(const EventFinder::Crossing& crossing, const Point& here, const AtRoots& roots);
  bool may_reset(const EventFinder::Crossing& crossing) const {
    return event_of(crossing).call || !event_of(crossing).reset.empty();
  }
  struct Applied {
    bool stop = false, changed = false;
    std::vector<EventFinder::Crossing> pending;
  };
  Applied apply_all(const EventFinder::Hit& hit, Point& point);
  bool may_change(int which, const std::vector<Expr>& reset);
  EventReply apply(const EventFinder::Crossing& crossing, Point& point);
  void reset(Point& point, const std::vector<std::pair<Expr, double>>& values);
  enum class Moment {
    later,
    same
  };  ///< than the last event: those at one time, which settle() counts, do not accumulate
  void restart(const Point& point, const Point& before, const EventFinder::Hit& hit,
               Moment moment = Moment::later);
  bool arrives(const Point& point, const Point& before, const EventFinder::Hit& hit);
  void check_accumulation(Point& point, const EventFinder::Hit& hit);
  void follow_sensitivities(const Point& before, const EventFinder::Hit& hit, double slope);
  void write_records(const Point& after);

  AdaptiveState& state_;
  ModeTracker& modes_;
  MonitorList& monitors_;
  ZenoDetector zeno_;
  double last_accumulation_ = -std::numeric_limits<double>::infinity();  ///< that ended on a border
  bool first_in_step_ = true;                                            ///< no event so far in the step
  std::optional<int> last_event_;                                        ///< the user's
  int since_event_ = 0;                                                  ///< restarts since then
  std::vector<double> happened_;                                         ///< by event: when it did last
  std::vector<std::optional<std::vector<Expr>>> behind_;  ///< by event, see states_behind(); made when asked
  std::vector<EventRecord> records_;                      ///< of the events at one time
  EventFinder::Hit last_restart_;
};

}  // namespace pendula::integrate
