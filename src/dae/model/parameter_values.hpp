// Parameter values put into expressions.
#pragma once

#include <span>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// Expressions with values of parameters put in, numbers such as cos(π/2) simplified to 0.
std::vector<Expr> at_values(std::span<const Expr> expressions, const ParameterValues& values);
/// The residuals at the parameter values of the model.
std::vector<Expr> residuals_at_values(const Model& model);

}  // namespace pendula::dae
