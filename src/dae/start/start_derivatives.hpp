// Derivatives at a start that its model does not name.
#pragma once

#include <unordered_map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// Adds to `values` (of all leaves of the model, its parameters and t) those of `wanted`: higher derivatives
/// of variables, from the equations differentiated until they determine them. `inputs`: what inputs are as
/// expressions of t. Returns false where they do not, and where the derivative of an input is not known.
/// cost      one orthogonal decomposition of the derivative array per differentiation
bool add_derivatives(const Model& model, const std::vector<Expr>& wanted, const Substitution& inputs,
                     std::unordered_map<Expr, double>& values);

}  // namespace pendula::dae
