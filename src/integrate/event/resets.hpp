// Resets of states: the other states are adapted so that the conditions of the model hold again.
#pragma once

#include <functional>

#include "dae/analysis/analysis.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Conditions on the states alone that a reset must not break: hidden constraints and invariants.
std::vector<dae::Constraint> state_conditions(const dae::Model& model);

/// Moves states that were not reset onto the conditions that a reset has broken: first those that no other
/// condition contains (a velocity that was reset changes velocities and leaves positions alone), if that is
/// not enough, all of them.
/// Empty where the model has no conditions. Called with the point and the numbers of the states that were
/// reset; throws Failure.
std::function<void(Point&, const std::vector<int>&)> reinitialiser(const dae::Model& model,
                                                                   const ProblemPtr& problem,
                                                                   const Substitution& inputs);
/// The same for these conditions, in the states and parameters of the problem, instead.
std::function<void(Point&, const std::vector<int>&)> reinitialiser(const std::vector<Expr>& conditions,
                                                                   const ProblemPtr& problem);

}  // namespace pendula::integrate
