// The characteristic polynomial of a linear model whose coefficients contain parameters.
#pragma once

#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// det P(s) with P_ij(s) = Σ_k ∂F_i/∂x_j^(k) sᵏ: up to its sign det(sE - A) of the model written with first
/// derivatives. Its degree is the number of free initial values wherever its leading coefficient is not 0;
/// where all coefficients are 0 the pencil is singular.
///
/// requires  as many equations as unknowns, at most 12; coefficients of the unknowns without unknowns or t
/// returns   the coefficients of s⁰, s¹ …, in parameters as symbols; empty: identically 0
/// throws    Error naming the equation that is not linear with constant coefficients
/// see       Kunkel & Mehrmann, Differential-Algebraic Equations, 2006, §2.1
std::vector<Expr> pencil_polynomial(const Model& model);

}  // namespace pendula::dae
