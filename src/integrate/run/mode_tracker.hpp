// Which branch of piecewise equations is in force, from one crossing to the next (event/surfaces.hpp), and
// where branches are no longer frozen.
//
// A border is unfrozen, that is its branches are evaluated as they are written from then on and its crossings
// are not located, where freezing it does more harm than good:
//
//   - the solution continues on neither side, or crosses it infinitely often: two voltages that become equal
//   - crossings follow each other within two steps, six times, or make up a quarter of all steps: locating
//     costs more than a kink inside a step
//   - a step fails: a frozen branch has been evaluated far outside its own domain
//
// and only if the equations are continuous there: by their expressions, or at the point (border_jump.hpp).
//
// Where they are not, and the solution continues on neither side, it slides along the border until it can
// leave to one of the sides (event/filippov.hpp).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "integrate/event/uniqueness.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/across_borders.hpp"
#include "integrate/run/adaptive_state.hpp"
#include "integrate/run/border_jump.hpp"
#include "integrate/run/excursions.hpp"
#include "integrate/run/method_selector.hpp"

namespace pendula::integrate {

class ModeTracker {
 public:
  using Crossings = std::vector<EventFinder::Crossing>;

  /// Requires that both outlive it.
  ModeTracker(AdaptiveState& state, MethodSelector& method);

  /// The modes at the start of the run, before there is a stepper.
  void initialise(const Point& point);
  /// Stepper and events begin at a point, in the modes of the side on which the solution continues, or
  /// sliding. crossed: the roots at this point. Throws Failure where the solution has no continuation.
  void begin(const Point& point, const Crossings& crossed);
  /// After a step without events: a crossing was missed, or the solution has left a surface it was on.
  bool differ() const;
  /// After a first step that began on a border whose side could not be told, since x′ does not follow from x
  /// (index 2): has it left the border? The run must then begin again where the step began, on that side.
  bool has_chosen_side(const Point& before);
  /// After a first step without a root, from a border to the side that a crossing or has_chosen_side() had
  /// shown: is it on the other side? One branch then leads to the side whose own leads back at once, and from
  /// the beginning of the step on the solution slides, if it can. The run must begin again there, where the
  /// stepper stands.
  bool slides_from_start(const Point& before);
  /// After a first step: throws Failure where the solution has no continuation on either side of a border:
  /// with the branch of one side the step has returned to the other.
  void require_way_on(const Point& before);
  /// Whether the step in state.view was on the other side of a unfrozen border and came back.
  bool has_missed_excursion() { return excursions_.in_last_step(); }
  /// Counts the crossings; unfreezes borders that are crossed too often. The run must begin again afterwards.
  void count(const Crossings& crossed, const Point& point);
  /// Unfreezes those of the borders among the crossings that can be; false if there are none.
  bool unfreeze(const Crossings& crossed, const Point& point);
  /// Did the solution, at the beginning of the step in state.view, stop sliding along a border and leave it
  /// to a side to which it bends? Crossings of that border right after are rounding.
  bool has_just_left(const EventFinder::Hit& hit);
  /// After a failure of a step: unfreezes all borders at which the equations are at least so smooth.
  bool unfreeze_all(const Point& point, Smoothness least = Smoothness::kink);
  /// Where crossings accumulate: the solution slides along all recently crossed borders; false if it cannot.
  /// near: false also if it is further from them than its errors.
  bool slide_where_crossed(const Point& point, bool near = false);
  /// The same where many steps make no progress: the solution may oscillate about a border by its errors
  /// alone. True where sliding was tried; the run must then restart where the stepper stands.
  bool slide_where_steps_are_tiny();
  /// True where the equations are continuous at every crossing.
  bool is_continuous(const Crossings& crossed) const;
  /// Writes the treatment of every border into the solution.
  void report() const;

  /// Why the solution continues on no side of a surface, nor along it.
  Failure chattering(const Event& surface) const;

 private:
  struct Border {
    long crossings = 0, last_step = -1000, quick = 0, slides = 0;
    Treatment treatment = Treatment::frozen;
    double since = 0, slid = 0;        ///< of the treatment; how long it slid before
    std::optional<std::size_t> exits;  ///< the first of the two events that end the sliding
    double farthest = 0;               ///< largest |s| at the ends of steps since the last attempt
    int released = 0;                  ///< while a run begins: the side to which the solution leaves
    int left = 0;                      ///< the side to which it has left, at `left_at`
    double left_at = 0;
  };
  const std::vector<Event>& events() const { return state_.plan.events.list; }
  bool is_frozen(std::size_t which) const {
    return which >= borders_.size() || borders_[which].treatment == Treatment::frozen;
  }
  void begin_in_some_mode(Point point, const Crossings& crossed);
  bool pass(const Crossings& crossed, const std::vector<int>& changed);
  bool try_modes(Point point, const Crossings& crossed, std::vector<int>& changed);
  bool begin_behind(const Point& point, const Crossings& crossed, bool nearest_first,
                    const std::vector<double>& arriving);
  std::vector<int> set_modes(const Point& point, const Crossings& crossed);
  void use(const std::vector<double>& sides);
  void use_modes();
  void start_finder(const Point& point, const Crossings& crossed);
  RhsSolver& derivative();
  bool on_edge_of_domain(const Point& point, const Crossings& crossed);
  double step_beside_root(const Point& point);
  void begin_with_short_step();
  double slope_ahead(int which, const Point& point, double share);
  /// share for the side on which a solution goes on: x′ is constant over it, and rounding
  /// is 10⁻¹⁰ of the change.
  static constexpr double step_ahead = 1e-6;
  double side_ahead(int which, const Point& point);
  bool leads_to(int which, const Point& point, int other, int side);
  bool unfreeze_one(int which, const Point& point);
  bool slide(int which, Point& point);
  Vec errors_at(const Point& point) const;
  Expr reach(int which, const Vec& errors) const;
  std::vector<int> within_reach(const std::vector<int>& borders, const Point& point) const;
  bool is_near(const std::vector<int>& borders, const Point& point, const Point& there) const;
  bool slide_along_one_of(const std::vector<int>& candidates, const Point& point, bool near);
  void release(int which, int side, double t);
  std::vector<std::pair<int, int>> outside() const;
  std::vector<Treatment> treatments() const;
  void rebuild(const Point& point);
  void renew_exits(const std::unordered_map<Expr, double>& values);
  std::string treatment_text(const Border& border) const;

  AdaptiveState& state_;
  MethodSelector& method_;
  BorderJump jump_;
  AcrossBorders across_;
  Excursions excursions_;
  UniquenessCheck uniqueness_;
  std::vector<double> modes_;
  std::vector<Border> borders_;  ///< of every event of the plan; exits stand behind them
  std::vector<Expr> weights_;    ///< of the borders that slide, in the order of their surfaces
  /// The last attempt to slide because the steps were tiny, and the steps until the next.
  struct {
    long steps = 0, interval = 100;
    double t = 0;
  } attempts_;
  Crossings begun_;                     ///< at the last restart of the run
  std::vector<std::size_t> undecided_;  ///< borders on which it began, on no side
  Crossings headed_;                    ///< from borders on which it began, to the side that it should take
  double begun_at_ = 0;
  long crossings_ = 0;  ///< of borders that can be unfrozen, at different times
  std::unique_ptr<RhsSolver> derivative_;
};

}  // namespace pendula::integrate
