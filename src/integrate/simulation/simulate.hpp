// From a model and a request to a trajectory.
#pragma once

#include "integrate/simulation/trajectory.hpp"

namespace pendula::integrate {

/// A tolerance for all unknowns and others for some of them, by the leaves of the model.
struct ToleranceRequest {
  std::optional<double> all;
  std::vector<std::pair<Expr, double>> some;
  std::vector<double> list;  ///< instead: in the order of the states, then the algebraic variables
};

/// What a run does where several solutions go on from a point: smoothly, or with the
/// derivatives nearest to these.
struct BranchChoice {
  std::vector<std::pair<Expr, double>> derivatives;  ///< leaves of any order; empty: smoothly
};

/// Which choices the caller of simulate() changes along the run; simulate() itself changes the others: which
/// of redundant constraints are kept (constraint_reselection.hpp), which states and rows
/// (state_reselection.hpp, array_run.hpp).
enum class ChosenOutside { nothing, constraints, all };

struct Simulation {
  dae::ConsistentStatePtr start;    ///< of this model; x is taken from it, x′ and z as starting values
  dae::ParameterValues parameters;  ///< override those of the model
  Substitution inputs;              ///< input leaf (of any order) -> expression in t and parameters
  std::vector<std::pair<Expr, Problem::Input>> numeric_inputs;
  Method method;  ///< with plan.dt: a tableau or a multistep method
  Plan plan;      ///< its tolerances, variable indices and events are filled in from what follows
  ToleranceRequest rtol, atol;
  std::vector<ModelEvent> events;
  std::optional<BranchChoice> branch;  ///< absent: the run stops there
  std::vector<Expr> sensitivities;     ///< parameters, and states that stand for their initial values
  ChosenOutside chosen = ChosenOutside::nothing;
  bool many_parameters = false;  ///< the problem is evaluated with other parameters, too: none is folded
};

/// Integrates a model. Without plan.dt: with error control, rtol = 1e-6 and atol = 1e-3 rtol where nothing
/// else is asked for. Throws Error when the index is 2 or more (unless plan.direct), a parameter or an
/// input has no value, the derivative of an input that is only known as a function of numbers is needed;
/// and whatever integrate() throws.
TrajectoryPtr simulate(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
