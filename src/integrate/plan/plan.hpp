// The request for a run: the interval, the method, the tolerances, what to save and what to react to.
//
// plan.hpp (here): `Plan` and `Method`, plain data, and their checks. run_monitors.hpp: the monitors that a
// plan asks for, for fixed and for chosen steps. stall_detector.hpp: ends runs that make no progress. Whoever
// integrates (integrate/run) gets a Problem, a start and a Plan; whoever asks for a run
// (integrate/simulation) makes them.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "integrate/event/events.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/solve/stats.hpp"
#include "integrate/solve/tolerances.hpp"
#include "method/multistep.hpp"
#include "method/rosenbrock.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

struct TreatedProblem {
  ProblemPtr problem;
  std::vector<Expr> weights;  ///< of the surfaces that slide, in their order
};

struct Plan {
  double from = 0, to = 0;
  std::optional<double> dt;  ///< fixed steps of this length; absent: steps are chosen by the error
  /// Ascending times inside [from, to] at which points are saved; every mesh point if absent. Fixed steps: a
  /// time between two mesh points is reached by a shortened step of its own, the mesh does not depend on
  /// `times`. Chosen steps: the continuous extension is evaluated.
  std::optional<std::vector<double>> times;
  bool direct = false;  ///< integrate a model of index 2 or more as it stands

  /// Called after every step; true ends the run there (Ending::stop_when). Called at a border of piecewise
  /// equations, too, where true ends the run at the step before it.
  std::function<bool(const Point&)> stop_when;

  bool check_singularities = true;  ///< false: no guards, no blocks
  std::vector<Guard> guards;        ///< where one vanishes, the run stops
  std::vector<Guard> choices;  ///< where one rests at 0 within the tolerances, a run with chosen steps stops
  /// Called where a run stops: "; solutions go on there with z′ = -1 or z′ = 1", or "". here: a guard
  /// vanishes at this point; otherwise the point where solutions meet is searched ahead.
  std::function<std::string(const Point&, bool here)> continuations;
  std::vector<dae::LargeBlock> blocks;  ///< where one loses its rank, the run stops (rank_monitor.hpp)

  // ── chosen steps only ──
  Tolerances tolerances;  ///< empty: rtol = 1e-6, atol = 1e-9
  std::function<Vec()>
      sizes;  ///< natural_sizes() at the start, asked where a block seems to lose its rank; may be null
  double dt_first = 0;  ///< 0: chosen
  double dt_max = std::numeric_limits<double>::infinity();
  long most_steps = 10'000'000;
  /// Index of every unknown of (x, z) for the error test of a model of index 2 or 3 (Hairer & Wanner II,
  /// §VII.4); empty: all 1.
  std::vector<int> variable_index;
  /// x′ and z follow from t and x.
  bool is_determined() const {
    return std::all_of(variable_index.begin(), variable_index.end(), [](int i) { return i == 1; });
  }
  /// Chains of derivatives as unknowns (form "array"): each one is a difference of larger ones, so that
  /// rounding errors are monitored at every tolerance.
  bool has_chains = false;
  SmallStates small_states;
  EventList events;
  int modes = 0;  ///< of the surfaces among the events
  /// The same problem with each surface treated as asked for (event/surfaces.hpp), by their numbers. Throws
  /// Failure as PiecewiseForm::form() does.
  std::function<TreatedProblem(const std::vector<Treatment>&, const std::unordered_map<Expr, double>& at)>
      treat;
  std::vector<double> breaks;  ///< ascending: times at which the equations are not smooth; steps end there
  /// Inputs known by value only; each step is checked for a jump or kink in them.
  std::vector<std::function<double(double)>> monitored_inputs;
  /// Called every few steps with the time reached; for a progress line.
  std::function<void(double t, const Stats&)> progress;
};

struct MethodFamily;  // methods.hpp

/// A method of any kind: with fixed steps a tableau or a multistep method, with chosen
/// steps a family and what it needs.
struct Method {
  const MethodFamily* family = nullptr;  ///< of adaptive methods; none: "auto", chosen for the model
  TableauPtr tableau;
  int order = 0;  ///< the highest of variable-order BDF; 0: 5
  RosenbrockPtr rosenbrock;
  MultistepPtr multistep;                   ///< with fixed steps
  std::vector<TableauPtr> explicit_choice;  ///< "auto": for looser to tighter tolerances, see choose()
};

/// Throws Error on a bad interval: from, to, times, what is not finite.
void check_interval(const Plan& plan);
/// The start at time `from`, with zeros for x′ ∈ ℝⁿ and z ∈ ℝᵐ where it says nothing. Throws Error naming a
/// state that is not finite.
Point checked_start(Point start, const Problem& problem, double from);
/// The interval, and dt: positive, and not so small that the steps could not be saved.
void check_fixed(const Plan& plan, const Problem& problem);
/// The interval, and what belongs to chosen steps: tolerances, dt_first, dt_max, most_steps.
void check_adaptive(const Plan& plan);

}  // namespace pendula::integrate
