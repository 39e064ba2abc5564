// How the equations of a Lagrangian model were derived, step by step, as in a solution sheet.
#pragma once

#include <string>
#include <vector>

#include "dae/model/derivation_markup.hpp"
#include "dae/model/model.hpp"

namespace pendula::mech {

/// The lines of the derivation of a model made by lagrange(): energies, L, its partial derivatives, the
/// constraint Jacobian, generalised forces by virtual work, the equations, W and c, the blocks of first
/// order. Columns are split by the names that vectors have now, so the lines are made when they are printed.
/// requires  model.mechanics
std::vector<std::string> derivation(const dae::ModelPtr& model);

/// The derivation of any model: from the energies where it is or (in every step)
/// stems from a Lagrangian model.
std::string trace(const dae::ModelPtr& model, dae::Detail detail, dae::Notation notation);

}  // namespace pendula::mech
