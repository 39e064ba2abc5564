// Roots of event functions along a solution, and what happens there (docs/derivations.md#events).
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "integrate/event/bracket.hpp"
#include "integrate/event/event_conditions.hpp"
#include "integrate/event/surfaces.hpp"
#include "integrate/problem/projection.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

/// Request of a callback after the event.
struct EventReply {
  bool stop = false;
  std::vector<std::pair<Expr, double>> reset;  ///< state -> new value
};

struct Event {
  Expr when;  ///< in leaves of the problem; the event is a root of it
  dae::Direction direction = dae::Direction::both;
  bool stop = false;
  std::vector<std::pair<Expr, Expr>> reset;  ///< state -> its value after, in the values before
  std::function<EventReply(const Point&)> call;
  std::string termination_reason;  ///< not the user's: why the equations cannot be solved behind it
  bool surface = false;            ///< not the user's: the equations are not smooth there
  std::size_t surface_number = 0;
  Smoothness smoothness = Smoothness::open;
  std::vector<Mode> modes;  ///< of the surface
  bool is_edge = false;     ///< of the domain of a function: the surface
  /// Where the solution leaves a surface along which it slides: its number, and the side.
  struct Exit {
    int surface, side;
  };
  std::optional<Exit> exit;                      ///< not the user's
  std::vector<Expr> tangent;                     ///< d when/dp for the parameters of the sensitivities
  std::vector<std::vector<Expr>> reset_tangent;  ///< per entry of `reset`: d value/dp, then d value/dt
};

struct EventList {
  std::vector<Event> list;
  /// For a run that continues another one: on which side of its root each condition was just
  /// before the start. Events whose condition has jumped across its root happen at the start.
  /// Empty, or for the first events.
  std::vector<double> sides;
  /// Conditions that the states must satisfy after a reset, level by level; `reset` says which states keep
  /// their new value. Throws Error when they cannot.
  std::function<void(Point&, const std::vector<int>& reset)> reinitialise;

  /// May the states jump at one of them?
  bool may_jump() const {
    return std::any_of(list.begin(), list.end(), [](const Event& e) { return e.call || !e.reset.empty(); });
  }
};

/// The condition of an event turns faster than steps can be; shorter ones would show no more of it.
class Oscillation : public Failure {
 public:
  using Failure::Failure;
};

/// Finds the first root inside a step.
///
/// A step is sampled in pieces, unless cubics through its ends and its middle show that no condition comes
/// near zero. Between two samples a change of sign is a root; where the slopes say that g could have gone to
/// zero and back, the piece is halved a few times, more often for functions of time alone, which are cheap
/// and do not limit the step size themselves. A condition that contains sines and cosines is sampled once per
/// radian of their arguments: where it oscillates faster than the solution, its slopes at two samples say
/// nothing. One that contains exponentials, divisors and the like is sampled where these turn, too. Slopes
/// that the equations do not give are differences along the step. Where a root is found, the signs of the
/// other conditions there show roots of theirs that lie before it.
class EventFinder {
 public:
  /// stats: where the solutions of the equations inside steps are counted.
  EventFinder(const ProblemPtr& problem, const std::vector<Event>& events, Stats* stats = nullptr);

  struct Crossing {
    int which;
    bool rising;
    double g = 0;      ///< what is left of the condition where the root was located
    double slope = 0;  ///< of the chord in which it lies
  };
  /// Roots that cannot be told apart in time belong together.
  struct Hit {
    double t = 0;                ///< where the sign of the first has changed
    double before = 0;           ///< the last moment before
    std::vector<Crossing> list;  ///< in the order of the events
  };
  bool empty() const { return events_->empty(); }
  /// Its condition is one of t and parameters.
  bool is_moment(std::size_t which) const { return conditions_->clock[which]; }
  /// The equations give its slope; that of one with z or x′ is measured.
  bool knows_slope(std::size_t which) const { return conditions_->slope_known[which] != 0; }
  /// A condition inside a step.
  double value(Stepper& stepper, const StepView& step, int which, double t);
  /// The times of the run. A condition that is 0 to rounding at its end is a root.
  void set_interval(double from, double to) {
    end_ = to;
    span_ = std::max(std::fabs(from), std::fabs(to));
  }
  /// The first event whose condition has been a number at no point that was looked at.
  std::optional<int> never_finite() const;
  /// Inputs jump there: see Problem.
  void set_limit(double t) {
    problem_->set_limit(t);
    if (along_.problem) along_.problem->set_limit(t);
  }
  /// From now on, no root of this event is found; or again some.
  void ignore(int which, bool ignored = true) {
    ignored_[which] = ignored;
    count_wanted();
  }
  /// From now on, roots of these events alone are found.
  void ignore_all_but(const std::vector<int>& events) {
    std::fill(ignored_.begin(), ignored_.end(), char{1});
    for (const int which : events) ignored_[which] = 0;
    count_wanted();
  }
  /// Continues for another finder with the same events, followed by none or others.
  void take_over(const EventFinder& before, std::size_t events);
  /// The modes of the surfaces, which conditions may contain.
  void set_modes(const std::vector<double>& modes) { problem_->set_modes(modes); }
  /// At a new beginning: a zero of this event counts as this side of it.
  void set_side(int which, int side);
  /// Restart at a point: a condition that is zero here does not count as a root here, nor does the root from
  /// which the run restarts (crossed), unless it has changed since.
  void start(const Point& point, const std::vector<Crossing>& crossed = {});
  /// On which side of its root an event function is at the last point looked at: -1, 1, or 0.
  double side(int which) const;
  /// Every g at the last point looked at.
  const std::vector<double>& values() const { return last_.g; }
  /// After start(): the event function is 0 there, to rounding.
  bool is_on_border(std::size_t which) const { return std::fabs(last_.g[which]) <= tiny; }
  /// dg/dt at a point, 0 if it is not known: where g contains x′ or z, x″ or z′ would appear in it.
  double slope(int which, const Point& point);
  /// dg/dt between two points of a solution that are close to each other; where it is known, at the second.
  double slope_between(int which, const Point& a, const Point& b);
  /// The piecewise event with a termination_reason that is 0 at a point, beside its largest value so far: a
  /// divisor max(x, -x), whose own border hides that.
  std::optional<int> vanished(const Point& point);
  /// The same, of values(): at the end of a step.
  std::optional<int> vanished(const std::vector<double>& g) const;
  /// The first root in (from, to], where `from` is the last start or root, located to a few ulp of t.
  /// Requires events.
  std::optional<Hit> find(Stepper& stepper, const StepView& step);
  /// After a root that changes nothing: continues behind it.
  void pass(const Hit& hit, Stepper& stepper, const StepView& step);
  /// Has the condition of a reset only been 0 to rounding since the last sample, as for bodies
  /// that move side by side? Then it has crossed nothing, and the search continues after it, on
  /// the side where the condition was.
  bool rests(const Hit& hit, Stepper& stepper, const StepView& step);

 private:
  struct Sample {
    double t = 0;
    std::vector<double> g, slope, rate;  ///< rate: radians per time of the sines in g
    std::vector<double> narrow, bend;    ///< EventConditions::narrow, and their slopes
    std::vector<double> rounding_bound;  ///< rounding of those that the solution began on
    bool exact = true;                   ///< not of the coarse interpolant
  };
  static constexpr int pieces = 4;                                    ///< samples per step, more where needed
  static constexpr double tiny = std::numeric_limits<double>::min();  ///< a sign without a size
  static bool opposite(double a, double b) { return (a < 0 && b > 0) || (a > 0 && b < 0); }
  void evaluate(const Point& point, Sample& out) { evaluate(point, point.t, out); }
  void evaluate(const Point& point, double t, Sample& out);
  void count_wanted();
  bool interpolate(Stepper& stepper, const StepView& step, double t, Detail detail);
  void sample(Stepper& stepper, const StepView& step, double t, Detail detail, Sample& out);
  void sample_coarsely(Stepper& stepper, const StepView& step, double t, Sample& out);
  void measure_slopes(Stepper& stepper, const StepView& step, double t, Sample& out, double closest = 0);
  void sample_near_start(Stepper& stepper, const StepView& step, double t, Sample& out);
  void measure_along(Stepper& stepper, const StepView& step, double t, Sample& out, double closest = 0);
  bool differentiate(Stepper& stepper, const StepView& step, double t, Sample& out);
  bool solve_at(const Stepper& stepper, Point& at, double accuracy);
  void predict(const StepView& step, Point& at) const;
  struct Root {
    double before, t;
    bool rising;
  };
  bool is_zero(std::size_t i, const Sample& at) const;
  bool falls_to_zero(std::size_t i, const Sample& a, const Sample& b) const;
  bool may_reset(std::size_t i) const;
  double rounding(std::size_t i);
  bool is_invisible(std::size_t i);
  double slope_after(Stepper& stepper, const StepView& step, std::size_t i);
  bool stays_on_border(std::size_t i, const Sample& a, const Sample& b) const;
  bool wanted(std::size_t i, bool rising) const;
  bool oscillates(const Sample& a, const Sample& b, int depth);
  bool ends_at_zero(std::size_t i, const Sample& a, const Sample& b) const;
  bool may_hide(const Sample& a, const Sample& b, int depth) const;
  std::optional<Sample> turning_point(Stepper& stepper, const StepView& step, const Sample& a,
                                      const Sample& b);
  std::optional<Sample> between_turns(Stepper& stepper, const StepView& step, std::size_t part,
                                      const Sample& a, const Sample& b);
  void move_to_turn(Stepper& stepper, const StepView& step, std::size_t part, const Sample& a,
                    const Sample& b, double change, Sample& at);
  bool varies(std::size_t part, const Sample& a, const Sample& b) const;
  double bend(Stepper& stepper, const StepView& step, std::size_t part, double t, Detail detail);
  double turn(Stepper& stepper, const StepView& step, std::size_t part, const Sample& a, const Sample& b);
  bool stays_away(Stepper& stepper, const StepView& step);
  void begin_coarsely(Stepper& stepper, const StepView& step);
  void estimate_coarse_errors(const StepView& step);
  bool follows_coarsely(Stepper& stepper, const StepView& step);
  bool add_knot(Stepper& stepper, const StepView& step, double t);
  void refine(Stepper& stepper, const StepView& step);
  std::pair<const Point*, const Point*> piece(const StepView& step, double t) const;
  bool interpolate_coarsely(Stepper& stepper, const StepView& step, double t);
  bool is_certain(Stepper& stepper, const StepView& step, const Sample& at, const Sample& other);
  std::optional<Hit> verify_change(Stepper& stepper, const StepView& step, Sample& a, Sample& b);
  std::optional<Hit> scan(Stepper& stepper, const StepView& step, Sample& a, Sample& b, int depth,
                          int turns = 0);
  bool changes(const Sample& a, const Sample& b) const;
  void make_exact(Stepper& stepper, const StepView& step, Sample& at);
  void decide_zeros(Stepper& stepper, const StepView& step, const Sample& a, Sample& b);
  void settle_zeros(const Sample& a, Sample& b) const;
  std::optional<Root> root_between(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                   const Sample& b);
  double coarse_value(Stepper& stepper, const StepView& step, int which, double t);
  double coarse_root(Stepper& stepper, const StepView& step, int which, Bracket in);
  bool move_on(Stepper& stepper, const StepView& step, int which, double before, double apart, double& t,
               double& g);
  std::optional<Root> locate_or_beside(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                       const Sample& b, Bracket in, double rounding_bound);
  Root locate(Stepper& stepper, const StepView& step, int which, double a, double ga, double b, double gb,
              double rounding_bound);
  struct Dip {
    std::optional<double> below;  ///< a time at which g has the other sign
    double t, lowest;             ///< else where g is lowest, and its value; 0: not known
  };
  Dip dip(Stepper& stepper, const StepView& step, int which, const Sample& a, const Sample& b, Detail detail);
  std::optional<double> bottom_beside(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                      const Sample& b);
  std::optional<double> bottom(Stepper& stepper, const StepView& step, int which, const Sample& a,
                               const Sample& b);
  std::optional<Hit> first_hit(Stepper& stepper, const StepView& step, const Sample& a, const Sample& b);
  using Roots = std::vector<std::optional<Root>>;
  const std::optional<Root>& first_root(Stepper& stepper, const StepView& step, const Sample& a,
                                        Roots& roots);

  ProblemPtr problem_;
  const std::vector<Event>* events_;
  std::shared_ptr<const EventConditions> conditions_;
  codegen::Kernel kernel_;       ///< of the conditions, with a workspace of its own
  long uncounted_ = 0;           ///< samples of the run between which a sine turned
  std::vector<double> largest_;  ///< |g| so far
  /// By those that are not ignored: slopes along the step, more than t.
  struct {
    bool slopes = false, solution = false;
  } wants_;
  bool fresh_ = true;  ///< no step since the last start
  std::vector<char> ignored_, finite_;
  struct Beginning {
    bool resumed = false;  ///< the run has begun again at a root of this event
    int from = 0;          ///< and this is the side it came from
  };
  std::vector<Beginning> beginnings_;
  /// Of a condition that was 0 at the last start: what rounding makes of it.
  std::vector<double> rounding_bound_;
  std::vector<codegen::Kernel> terms_;  ///< Σ |∂g/∂y y|, of each event where it was asked for
  double end_ = std::numeric_limits<double>::infinity();
  double span_ = 1;    ///< times are rounded to ulp of it
  Sample last_;        ///< at the last point looked at; signs of zeros are those just after
  Sample last_exact_;  ///< the last exact sample before the coarse ones of the step
  Sample here_, probe_, neighbour_;
  Point point_, tangent_point_;
  /// Where x′ and z were solved for last, and x″ and z′ there.
  struct {
    Point at, rate;
  } last_solved_;
  /// The interpolant of steps of explicit methods, and how well it follows the solution.
  struct {
    std::vector<double> errors;  ///< of each condition; then of each narrow part, relative
    Vec off;                     ///< of the cubic through the ends of the step, in its middle; or empty
    Point before, beginning;     ///< beginnings of the step before and of this one, since the last start
    bool has_before = false, has_beginning = false;
    double end = 0;            ///< of this step
    std::vector<Point> knots;  ///< exact points inside it, between which there is a cubic of their own
  } coarse_;
  std::vector<double> out_;
  /// The equations of the stepper, which may be those of sliding, along the cubic of a step.
  struct {
    Stats* stats;
    std::shared_ptr<Stats> own_stats;  ///< where none are given
    const Problem* of = nullptr;       ///< the stepper's, and its version
    unsigned version = 0;
    ProblemPtr problem;
    std::shared_ptr<RhsSolver> equations;
  } along_;
};

}  // namespace pendula::integrate
