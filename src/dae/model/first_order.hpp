// A model as the integrators see it: F(t, x, x′, z, u, p) = 0 with x ∈ ℝⁿ, z ∈ ℝᵐ, F ∈ ℝⁿ⁺ᵐ.
//
// Variables of higher order are lowered without new names: the states of q″ = f are the leaves q and q′. The
// derivative of state i is the leaf x′ᵢ if no other state has that name (q″), else a slot (the K of q) tied
// by the trivial equation Kᵢ - q′ᵢ = 0, which stands first in F.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

struct FirstOrder {
  std::vector<Expr> x;             ///< n states
  std::vector<Expr> xdot;          ///< n leaves that stand for their derivatives in F
  std::vector<Expr> z;             ///< m algebraic variables
  std::vector<Expr> u;             ///< inputs and the derivatives of inputs that occur
  std::vector<Expr> p;             ///< parameters
  std::vector<Expr> F;             ///< n + m residuals in t, x, xdot, z, u, p
  std::vector<std::string> label;  ///< of each residual, for messages: "equation (3)"
  std::vector<std::optional<std::pair<Expr, Expr>>> sides;  ///< of the residuals as they were written

  /// Filled when the equations read x′ = f(t, x, z, u, p), 0 = g(t, x, z, u, p), up to order and scaling.
  bool semi_explicit = false;
  std::vector<Expr> f;  ///< n, in the order of x
  std::vector<Expr> g;  ///< m

  bool is_ode() const { return semi_explicit && z.empty(); }
};

/// The lowering for the integrators. Throws Error unless there are as many equations as unknowns.
FirstOrder first_order(const Model& model);
/// The same, remembered for the models in use.
std::shared_ptr<const FirstOrder> shared_first_order(const ModelPtr& model);

}  // namespace pendula::dae
