// Why the Jacobian of a form of index 1 with respect to (x′, z) is regular, where it
// is not, and what follows.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// e with the value it has on the constraints: pᵀp is L² where 0 = (pᵀp - L²)/2; e
/// itself where they say nothing.
Expr on_constraints(Expr e, const std::vector<Constraint>& constraints);

/// Lines of a derivation: rows that give a derivative directly, the matrix that remains, its
/// determinant and where it vanishes, and the unknowns that it gives. Empty for large models and for
/// equations that are not linear in (x′, z).
std::vector<std::string> rank_reason(const Model& low);

}  // namespace pendula::dae
