// Differentiating the constraints of a model as often as its offsets say.
#pragma once

#include "dae/model/model.hpp"
#include "dae/structure/sigma.hpp"

namespace pendula::dae {

/// Rows x_j′ = f whose right side needs no algebraic variable: what may be put in for x_j′ anywhere (p′ = v).
Substitution kinematics(const Model& model);

/// "(3)′", "C₁″": residual number `residual`, differentiated k times.
std::string constraint_label(const Model& model, std::size_t residual, int k);

struct Differentiated {
  std::vector<Block> blocks;            ///< the model with every constraint replaced by its last derivative
  std::vector<Constraint> constraints;  ///< what was left behind, in the order of derivation
  std::vector<std::string> trace;
};

/// Equation i is differentiated c_i times; rows x_j′ = f without algebraic variables
/// stay and are substituted instead.
Differentiated differentiate(const Model& model, const Offsets& offsets);

}  // namespace pendula::dae
