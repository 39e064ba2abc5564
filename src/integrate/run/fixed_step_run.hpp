// From a start to a solution: what is asked for, and the driver for fixed steps.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "dae/rank/large_blocks.hpp"
#include "integrate/event/events.hpp"
#include "integrate/run/solution.hpp"
#include "integrate/solve/tolerances.hpp"
#include "integrate/step/runge_kutta.hpp"
#include "method/multistep.hpp"
#include "method/rosenbrock.hpp"

namespace pendula::integrate {

/// What must not vanish along a solution, and what to say where it does.
struct Guard {
  Expr factor;         ///< in leaves of the problem
  std::string reason;  ///< "x = 0 there, and …"
  bool root = false;   ///< factor = √D stands for one of two roots that meet where D touches 0
};

struct Plan {
  double from = 0, to = 0;
  double dt = 0;  ///< 0: adaptive
  /// Ascending times inside [from, to] at which points are saved; every mesh point if absent. Fixed steps: a
  /// time between two mesh points is reached by a shortened step of its own, the mesh does not depend on
  /// `times`. Adaptive: the continuous extension is evaluated.
  std::optional<std::vector<double>> times;
  bool direct = false;  ///< integrate a model of index 2 or more as it stands

  /// Asked after every step; true ends the run there with the status "left".
  std::function<bool(const Point&)> leave;

  bool guarded = true;                  ///< false: none of the following two
  std::vector<Guard> guards;            ///< looked at after every step; where one vanishes, the run stops
  std::vector<dae::LargeBlock> blocks;  ///< the same for what must keep its rank (rank_monitor.hpp)

  // ── adaptive only ──
  Tolerances tolerances;  ///< empty: rtol = 1e-6, atol = 1e-9
  double dt_first = 0;    ///< 0: chosen
  double dt_max = std::numeric_limits<double>::infinity();
  long most_steps = 10'000'000;
  /// Index of every unknown of (x, z) for the error test of a model of index 2 or 3 (Hairer & Wanner II,
  /// §VII.4); empty: all 1.
  std::vector<int> variable_index;
  EventList events;
  int modes = 0;               ///< of the surfaces among the events
  std::vector<double> breaks;  ///< ascending: times at which the equations are not smooth; steps end there
  /// Inputs of which nothing is known: after every step it is looked whether they have jumped in it.
  std::vector<std::function<double(double)>> watched;
  /// Called every few steps with the time reached; for a progress line.
  std::function<void(double t, const Stats&)> progress;
};

/// A method of any kind. family: "tableau" (fixed steps, or adaptive by an embedded method or collocation),
/// "auto", "radau", "gauss", "bdf", "rodas"; order: the highest of variable-order BDF, 0: 5.
struct Method {
  std::string family = "auto";
  TableauPtr tableau;
  int order = 0;
  RosenbrockPtr rosenbrock;                 ///< of family "rodas"
  MultistepPtr multistep;                   ///< with fixed steps
  std::vector<TableauPtr> explicit_choice;  ///< "auto": for looser to tighter tolerances, see choose()
};

/// Throws Error on a bad plan: from, to, times, what is not finite.
void check_interval(const Plan& plan);
/// The start at time `from`, with zeros for x′ ∈ ℝⁿ and z ∈ ℝᵐ where it says nothing. Throws Error naming a
/// state that is not finite.
Point checked_start(Point start, const Problem& problem, double from);
/// The same, and dt: positive, and not so small that the steps could not be saved.
void check_fixed(const Plan& plan, const Problem& problem);
/// The interval, and what belongs to chosen steps: tolerances, dt_first, dt_max, most_steps.
void check_adaptive(const Plan& plan);

/// Steps tₖ = from + k dt; the last one is shortened to end at `to`. start: x is taken as it is, x′ and z are
/// starting values of Newton's method (start.t is ignored).
///
/// returns   the solution; when a step fails, a value is not finite or Ctrl-C is pressed, the part computed
/// so far, and
///           status() says why
/// throws    Error on a bad plan (dt ≤ 0, to ≤ from, times); Failure when the start determines no x′ and z
/// (index above 1)
///           or Newton finds none; what an input function throws
/// cost      per step of an s-stage fully implicit method: O((s(n + m))³) per Newton iteration
SolutionPtr integrate(ProblemPtr problem, TableauPtr tableau, Point start, const Plan& plan);

}  // namespace pendula::integrate
