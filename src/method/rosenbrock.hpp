// Rosenbrock–Wanner methods: linearly implicit, one linear system per stage, no Newton iteration.
//
// Definition (Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.7), x′ = f(t, x), J = ∂f/∂x:
//
//     kᵢ = Δt f(tₖ + αᵢΔt, xₖ + Σⱼ αᵢⱼkⱼ) + Δt J Σⱼ γᵢⱼkⱼ + γᵢ Δt² ∂f/∂t,    xₖ₊₁ = xₖ + Σᵢ bᵢkᵢ,
//     γᵢᵢ = γ, αᵢ = Σⱼ αᵢⱼ, γᵢ = Σⱼ γᵢⱼ, βᵢⱼ = αᵢⱼ + γᵢⱼ
//
// The computation of a step, in the variables u = Γk (ibid. (7.25)):
//
//     (1/(γΔt) M - J) uᵢ = f(tₖ + αᵢΔt, xₖ + Σⱼ aᵢⱼuⱼ) + M Σⱼ (cᵢⱼ/Δt) uⱼ + γᵢ Δt ∂f/∂t
//     xₖ₊₁ = xₖ + Σ mᵢuᵢ,   error = Σ eᵢuᵢ
//
// with (aᵢⱼ) = (αᵢⱼ)Γ⁻¹, (cᵢⱼ) = diag(1/γ) - Γ⁻¹, m = bΓ⁻¹. M may be singular: a
// semi-explicit DAE of index 1.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/math.hpp"
#include "expr/graph/matrix.hpp"
#include "method/exact/precise.hpp"

namespace pendula::integrate {

struct RosenbrockData {
  std::string name = "rosenbrock", text, cite;
  Expr gamma;                ///< γ, the diagonal of Γ
  MatX A, C;                 ///< s × s, strictly lower: aᵢⱼ and cᵢⱼ
  VecX m;                    ///< s
  std::optional<VecX> mhat;  ///< s, the embedded method; e = m - mhat
  MatX dense;                ///< r × s or empty: see Rosenbrock::dense()
  std::optional<int> order, embedded, dense_order, dae_order;  ///< claims, checked
};

class Rosenbrock {
 public:
  /// Throws Error naming the method: sizes, entries that are no numbers, γ = 0, Σ bᵢ ≠ 1, claims that the
  /// order conditions refute.
  explicit Rosenbrock(RosenbrockData data);

  const std::string& name() const { return data_.name; }
  const RosenbrockData& data() const { return data_; }
  int stages() const { return static_cast<int>(m_.size()); }

  // ── what a program uses ──
  double gamma() const { return gamma_; }
  const Mat& A() const { return A_; }            ///< aᵢⱼ
  const Mat& C() const { return C_; }            ///< cᵢⱼ
  const Vec& alpha() const { return alpha_; }    ///< αᵢ: where f is evaluated, in units of the step
  const Vec& gammas() const { return gammas_; }  ///< γᵢ: the factor of Δt ∂f/∂t
  const Vec& m() const { return m_; }
  const std::optional<Vec>& e() const { return e_; }  ///< m - mhat: the error estimate Σ eᵢuᵢ
  /// False where method and embedded method agree on x′ = A x: the estimate would be 0 there. Requires e().
  bool error_estimate_sees_linear() const;
  /// Dense output with r rows d₁ … dᵣ (2 for order 3, 3 for order 4; empty: none):
  ///   x(tₖ + θΔt) = (1-θ)xₖ + θ(xₖ₊₁ + (1-θ)(K₁ + θ(K₂ + θ K₃))),   Kⱼ = Σᵢ dⱼᵢuᵢ
  const Mat& dense() const { return dense_; }
  int dense_order() const { return dense_order_; }

  // ── the definition ──
  const Mat& alpha_matrix() const { return alphas_; }  ///< αᵢⱼ
  const Mat& gamma_matrix() const { return Gamma_; }   ///< γᵢⱼ, γ on the diagonal
  const Vec& b() const { return b_; }
  const Mat& beta() const { return beta_; }  ///< αᵢⱼ + γᵢⱼ

  /// Order for x′ = f(t, x) with the exact Jacobian (Thm IV.7.4).
  int order() const { return order_; }
  int embedded_order() const { return embedded_order_; }
  /// Order for the differential and algebraic variables of an index-1 DAE (§VI.4), at most 4 checked.
  int dae_order() const { return dae_order_; }
  bool is_stiffly_accurate()
      const;  ///< αₛᵢ + γₛᵢ = bᵢ and αₛ = 1: R(∞) = 0 and z solves its equations to first order

  // β and b to many digits, and the relative error they are known to.
  const RealMatrix& real_beta() const { return real_beta_; }
  const RealVector& real_b() const { return real_b_; }
  double unit() const { return unit_; }

  std::string str() const;
  std::string report() const;

 private:
  void transform();
  void decide_orders();
  RosenbrockData data_;
  double gamma_ = 0, unit_ = 0;
  RealMatrix real_alpha_, real_gamma_, real_beta_;
  RealVector real_b_, real_bhat_;
  Mat A_, C_, alphas_, Gamma_, beta_, dense_;
  Vec alpha_, gammas_, m_, b_;
  std::optional<Vec> e_;
  int order_ = 0, embedded_order_ = 0, dense_order_ = 0, dae_order_ = 0;
};

using RosenbrockPtr = std::shared_ptr<const Rosenbrock>;

}  // namespace pendula::integrate
