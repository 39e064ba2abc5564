// Building a model from equations.
#pragma once

#include "dae/model/model.hpp"

namespace pendula::dae {

/// The attributes of the model to be made (values override the parameters' defaults), and its unknowns.
struct ModelOptions : ModelAttributes {
  std::vector<Expr> x, z, u;  ///< declared unknowns and inputs; when any is given, everything else is refused
};

/// Builds and classifies a model. Throws Error: no equations, sizes differ, two symbols of one name, a symbol
/// that was not declared although x, z or u were given, a derivative of a variable declared algebraic. Cost:
/// linear in the size of the expressions, plus one rank computation of ∂F/∂x′.
ModelPtr make_model(std::vector<Block> blocks, ModelOptions options = {});

/// The same model with other parameter values. Throws Error on a parameter it does not have.
ModelPtr with_values(const ModelPtr& model, const ParameterValues& values);

}  // namespace pendula::dae
