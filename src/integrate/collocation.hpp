// Collocation methods from their nodes: (68)–(73) of the exam.
#pragma once

#include "integrate/tableau.hpp"

namespace pendula::integrate {

/// The collocation method with nodes τ₁ … τₛ in units of the step: aᵢⱼ = ∫₀^τᵢ ℓⱼ, bⱼ = ∫₀¹ ℓⱼ (69), (70).
/// Exact where the nodes are fractions, else doubles rounded from many digits. Throws Error on repeated
/// nodes.
Tableau collocation(std::span<const Expr> nodes);

/// Gauss-Legendre, order 2s: the nodes are the zeros of the shifted Legendre polynomial (73).
/// Requires 1 ≤ s ≤ 100. Cost: O(s³) operations on numbers of 256 + 16 s bits (s = 100: under a second).
Tableau gauss(long stages);

/// Radau IIA, order 2s - 1: the last node is 1, hence stiffly accurate and R(∞) = 0.
/// Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5.
Tableau radau(long stages);

}  // namespace pendula::integrate
