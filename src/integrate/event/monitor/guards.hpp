// Conditions for the equations of a run to be solvable: divisors that must not vanish,
// blocks that must keep their rank.
#pragma once

#include <string>
#include <vector>

#include "dae/singular/domain_conditions.hpp"
#include "dae/singular/large_blocks.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// An expression that must not vanish along a solution.
struct Guard {
  Expr factor;         ///< in leaves of the problem
  std::string reason;  ///< "x = 0 there, and …"
  bool root = false;   ///< factor = √D stands for one of two roots that meet where D touches 0
};

/// The divisors of the model's form, and the solvability conditions of its equations.
/// all: also what no consistent point makes 0, at the parameter values that the form was made with.
std::vector<Guard> guards_of(const dae::ModelPtr& model, const Substitution& inputs, const Problem& problem,
                             bool all);

/// Where the form's choice of states ends (dae::choice_conditions).
std::vector<Guard> choices_of(const dae::ModelPtr& model, const Substitution& inputs, const Problem& problem);

/// Blocks too large for symbolic guards, with the run's inputs in their entries; only those whose entries
/// are known where the run computes.
std::vector<dae::LargeBlock> blocks_of(const dae::ModelPtr& model, const Substitution& inputs,
                                       const Problem& problem);

/// dae::domain_conditions of the equations, remembered. Valid until the next call.
const std::vector<dae::DomainCondition>& domain_conditions_of(const Problem& problem);

/// Every leaf of e is known or a constant.
bool all_known(Expr e, const Problem& problem);
/// Does it depend on time, or on what changes with it?
bool varies(Expr e, const Problem& problem);

}  // namespace pendula::integrate
