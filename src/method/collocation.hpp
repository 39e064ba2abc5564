// Collocation methods and their relatives from nodes: Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed.,
// §II.7; docs/derivations.md#gauss.
#pragma once

#include "method/exact/polynomial.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// The collocation method with nodes τ₁ … τₛ in units of the step: aᵢⱼ = ∫₀^τᵢ ℓⱼ, bⱼ = ∫₀¹ ℓⱼ (HNW Thm
/// II.7.7). Exact where the nodes are fractions or lie in one field ℚ(√d), else doubles rounded from many
/// digits. Throws Error on repeated nodes.
Tableau collocation(std::span<const Expr> nodes);

/// Gauss-Legendre, order 2s: the nodes are the zeros of the shifted Legendre polynomial.
/// Requires 1 ≤ s ≤ 100. Cost: O(s³) operations on numbers of 256 + 16 s bits (s = 100: under a second).
Tableau gauss(long stages);

/// Radau IIA, order 2s - 1: the last node is 1, hence stiffly accurate and R(∞) = 0.
/// Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5.
Tableau radau(long stages);

/// Radau IA, order 2s - 1: the first node is 0, D(s) in place of C(s) (Ehle; ibid., Def. 5.3).
Tableau radau_ia(long stages);

/// Lobatto methods with nodes 0 and 1, order 2s - 2, s ≥ 2; `kind` is "IIIA" (collocation), "IIIB" (its
/// transpose), "IIIC" (aᵢ₁ = b₁, L-stable), "IIIC*" (aᵢₛ = 0), "IIID" (the mean of IIIC and IIIC*), "IIIE"
/// (the mean of IIIA and IIIB). Ibid., §IV.5; Jay, Lobatto methods, Encyclopedia of Applied and Computational
/// Mathematics, 2015. Throws Error on other kinds.
Tableau lobatto(const std::string& kind, long stages);

/// The Lagrange polynomials ℓⱼ of the nodes and their integrals Lⱼ(τ) = ∫₀^τ ℓⱼ, by increasing power of τ.
struct LagrangeBasis {
  std::vector<Polynomial> ell, integral;
};
/// Exact; nothing unless the nodes lie in one field ℚ(√d).
std::optional<LagrangeBasis> exact_lagrange(const Tableau& rk);
/// The same in doubles, for any distinct nodes: coefficients of ℓⱼ in row j.
Mat lagrange(const Tableau& rk);

/// ∫₀¹ ∏ᵢ(τ - τᵢ) τ^k dτ for k = 0, 1, …, which vanish for k < q exactly if the quadrature has order s + q
/// (Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.7).
std::vector<Real> orthogonality_integrals(const Coefficients& rk, int count);
std::optional<std::vector<Surd>> exact_orthogonality_integrals(const Tableau& rk, int count);

}  // namespace pendula::integrate
