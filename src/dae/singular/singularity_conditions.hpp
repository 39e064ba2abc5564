// Singularity conditions: what must not vanish along a solution.
//
// Where one of these expressions is 0, the equations no longer determine the solution, or a form is not
// equivalent to its model. singularity_conditions.hpp (here): expressions, from what a form divided by and
// from the factors of the determinant of the system Jacobian (analysis/determinant_factors.hpp).
// large_blocks.hpp: blocks too large for a written determinant, as matrices whose rank is monitored.
// integrate/event/monitor stops a run at both.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// Divisors of a form (Model::singularity_conditions), and the factors of the determinant of the system
/// Jacobian of the model that it was made from: where one of them vanishes, derivatives or algebraic
/// variables are no longer determined, whatever the form. Factors of parameters alone, and factors that no
/// consistent point makes 0 at the model's parameter values, are left out; `all`: the latter are kept, for
/// other values. Written in unknowns of `model`. Empty where the analysis is not regular. Not covered: blocks
/// of more than four equations, but for factors of the mass matrix of up to four coupled coordinates. Cost:
/// that of determinant_factors(), remembered.
std::vector<SingularityCondition> singularity_conditions(const ModelPtr& model, bool all = false);

/// Expressions that must not vanish if the rows chosen by form "array" are to determine its unknowns,
/// although the model may have solutions there. Empty for other forms. Cost: that of
/// determinant_factors(), cached.
std::vector<SingularityCondition> choice_conditions(const ModelPtr& model);

/// "x ≠ 0, y ≠ 0": what the form divided by.
std::string singularity_conditions_text(const Model& model);

/// Throws Error where something that the form divided by is 0 (to rounding) at these values.
void require_nonsingular(const Model& model, const std::unordered_map<Expr, double>& values);

}  // namespace pendula::dae
