// Where the equations of a model determine its solution: what must not vanish along it.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// What a form divided by (Model::domain), and the factors of the determinant of the system Jacobian of the
/// model that it was made from: where one of them vanishes, derivatives or algebraic variables are no longer
/// determined, whatever the form. Factors of parameters alone, and factors that no consistent point makes 0
/// at the model's parameter values, are left out; `all`: the latter are kept, for other values.
/// Written in unknowns of `model`. Empty where the analysis is not regular. Not covered: blocks of more than
/// four equations, but for factors of the mass matrix of up to four coupled coordinates. Cost: that of
/// validity(), remembered.
std::vector<Nonzero> domain(const ModelPtr& model, bool all = false);

/// "x ≠ 0, y ≠ 0": what the form divided by.
std::string domain_text(const Model& model);

/// Throws Error where something that the form divided by is 0 (to rounding) at these values.
void require_domain(const Model& model, const std::unordered_map<Expr, double>& values);

}  // namespace pendula::dae
