// The conditions that equations and their derivatives impose on the states, everything else eliminated.
//
// Rows that are linear in an unknown that is no state (x′, x″, z …), with a coefficient free of such
// unknowns, are solved for it, and the solution is put into the other rows; rows without such unknowns are
// conditions. For linear systems this is elimination with functions of t as multipliers; for nonlinear ones
// it follows the chain of substitutions a person would make.
#pragma once

#include <vector>

#include "dae/model/model.hpp"
#include "dae/structure/sigma.hpp"

namespace pendula::dae {

/// Residual `equation` of the model, differentiated `derivative` times.
struct DerivedRow {
  Expr residual;
  int equation, derivative;
};

/// F_i^(k), k ≤ c_i: what determines consistent points where the structure is right.
std::vector<DerivedRow> rows_by_offsets(const Model& model, const Offsets& offsets);
/// F, F′ … F^(order).
std::vector<DerivedRow> rows_up_to(const Model& model, int order);

/// Do all residuals contain states, inputs, parameters and t only?
bool on_states_only(const Model& model, const std::vector<Constraint>& constraints);

/// At most `wanted` independent conditions on `states` (those of the model, or of the one it was made from),
/// by order of derivative; fewer where elimination does not reach them (rows that are nonlinear in what has
/// to be eliminated, expressions that become too long). Values of parameters are not put in. Cost: one
/// substitution per pair of rows.
std::vector<Constraint> hidden_constraints_on_states(const Model& model, const std::vector<Expr>& states,
                                                     std::vector<DerivedRow> rows, int wanted);

}  // namespace pendula::dae
