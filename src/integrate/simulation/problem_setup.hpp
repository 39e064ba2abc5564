// Turns a Simulation request into a Problem, a start and a Plan.
#pragma once

#include "integrate/event/surfaces.hpp"
#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// The numbers of a run: everything but the method and the plan.
struct ProblemSetup {
  ProblemPtr problem;
  Point start;
  std::shared_ptr<const Variational> variational;
  /// Of chosen steps: the form with its branches frozen, and how to make the problem with other treatments.
  std::shared_ptr<const PiecewiseForm> piecewise;
  decltype(Plan::treat) treat;
};

/// Throws Error when a parameter or an input has no value.
ProblemSetup set_up_problem(const dae::ModelPtr& model, const Simulation& simulation);
/// The same without sensitivities and for any start: the model with parameters and inputs put in.
ProblemPtr make_problem(const dae::ModelPtr& model, const Simulation& simulation);

/// Throws Error where the index is 2 or more, with the remedy.
void require_low_index(const dae::Model& model, bool direct);

/// Writes the model's events, tolerances and indices into the plan of a run. so_far: the trajectory that
/// callbacks of events see; it is filled in later.
void complete_plan(Plan& plan, const dae::ModelPtr& model, const Simulation& simulation,
                   const ProblemSetup& run, const std::shared_ptr<TrajectoryPtr>& so_far);

/// S(0), n × k: how x(0) changes with what `all` is differentiated by; values: of parameters and t.
Mat start_sensitivity(const Variational& all, const dae::Model& model, const dae::ConsistentState& start,
                      const Substitution& inputs, std::unordered_map<Expr, double> values);

}  // namespace pendula::integrate
