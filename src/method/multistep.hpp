// Linear multistep methods, given by two lists of exact coefficients:
//
//     Σᵢ αᵢ xₖ₊₁₋ᵢ = Δt Σᵢ βᵢ f(xₖ₊₁₋ᵢ),   i = 0 … k,   i = 0: the new point
//
// ρ(ζ) = Σᵢ αᵢ ζ^(k-i), σ(ζ) = Σᵢ βᵢ ζ^(k-i). Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed.,
// §III.2–III.3; Hairer & Wanner, Solving ODEs II, 2nd ed., §V.1–V.2. For a DAE F(t, x, x′, z) = 0 a BDF
// method replaces x′ at the new point by Σᵢ αᵢ xₖ₊₁₋ᵢ / (β₀Δt).
#pragma once

#include <complex>
#include <memory>
#include <string>
#include <vector>

#include <gmpxx.h>

#include "base/math.hpp"

namespace pendula::integrate {

class Multistep {
 public:
  using Fractions = std::vector<mpq_class>;

  /// Throws Error naming the method: lists of different length, α₀ = 0, not
  /// consistent (ρ(1) = 0, ρ′(1) = σ(1)).
  Multistep(std::string name, Fractions alpha, Fractions beta);

  const std::string& name() const { return name_; }
  int steps() const { return static_cast<int>(alpha_.size()) - 1; }
  const Fractions& alpha() const { return alpha_; }
  const Fractions& beta() const { return beta_; }
  bool is_explicit() const { return beta_[0] == 0; }
  bool is_bdf() const;  ///< only β₀ ≠ 0

  /// The largest p with Σᵢ αᵢ(-i)^q = q Σᵢ βᵢ(-i)^(q-1) for q ≤ p, exactly.
  int order() const { return order_; }
  /// C: the defect of a smooth solution is C Δt^(p+1) x^(p+1) when the method is scaled to σ(1) = 1.
  mpq_class error_constant() const;

  /// The zeros of ρ, largest first, the principal one ζ = 1 left out.
  std::vector<std::complex<double>> parasitic_roots() const;
  /// All zeros of ρ in the closed unit disc, those on the circle simple.
  bool is_zero_stable() const;
  /// ρ(e^{iφ})/σ(e^{iφ}): the boundary of the stability region.
  std::complex<double> locus(double angle) const;
  /// z = λΔt: all zeros of ρ(ζ) - zσ(ζ) in the closed unit disc.
  bool is_stable_at(std::complex<double> z) const;
  /// The largest α in degrees with A(α)-stability; 0 if there is none, 90 if A-stable.
  double alpha_degrees() const;
  /// On (-x, 0): x; ∞ if the whole negative axis is stable.
  double real_limit() const;
  /// The zeros of σ inside the unit disc: a stiff component dies out at infinity. Requires
  /// A(α)-stability to mean anything.
  bool is_stable_at_infinity() const;

  /// "11/6 x₊₁ - 3 x + …= Δt f₊₁": the method as a formula.
  std::string formula() const;
  std::string str() const;     ///< name, formula, order
  std::string report() const;  ///< everything above in words, over several lines

 private:
  double largest_root(std::complex<double> z) const;

  std::string name_;
  Fractions alpha_, beta_;
  int order_ = 0;
};

using MultistepPtr = std::shared_ptr<const Multistep>;

/// The k-step backward differentiation formula, 1 ≤ k ≤ 6, derived: Σⱼ ∇ʲx/j = Δt f. Throws Error for k ≥ 7,
/// with the root of ρ that makes it unstable.
Multistep bdf(long steps);

}  // namespace pendula::integrate
