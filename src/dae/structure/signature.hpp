// Signature, incidence and system Jacobian: what the structural analysis reads off the expressions.
#pragma once

#include <vector>

#include "dae/model/model.hpp"
#include "dae/structure/blocks.hpp"
#include "dae/structure/sigma.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {

/// The unknowns of a model, order 0.
std::vector<Expr> unknowns_of(const Model& model);

/// σ_ij of every equation.
Signature signature(const Model& model);
Signature signature(const std::vector<Expr>& residuals, const std::vector<Expr>& variables);

/// J_ij = ∂F_i/∂x_j^(d_j - c_i) by rows; equal to ∂F_i^(c_i)/∂x_j^(d_j) by Griewank's
/// lemma (Pryce 2001, eq. (3.2)).
std::vector<Entry> system_jacobian(const std::vector<Expr>& residuals, const std::vector<Expr>& variables,
                                   const Offsets& offsets, const Signature& sigma);

/// Who appears where, whatever the order of derivative: the pattern for over- and under-determined parts.
Pattern incidence(const Model& model);

}  // namespace pendula::dae
