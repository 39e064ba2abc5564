// Algebraic Riccati equations, and the feedback and observer gains they give.
//
//   continuous   AᵀX + XA - (XB + S) R⁻¹ (BᵀX + Sᵀ) + Q = 0            K = R⁻¹ (BᵀX + Sᵀ)
//   discrete     AᵀXA - X - (AᵀXB + S)(R + BᵀXB)⁻¹(BᵀXA + Sᵀ) + Q = 0   K = (R + BᵀXB)⁻¹ (BᵀXA + Sᵀ)
//
// X is the stabilising solution: all eigenvalues of A - B K are stable. It is the limit of a
// structure-preserving doubling iteration, in continuous time after a Cayley transform (Chu, Fan & Lin,
// Linear Algebra Appl. 396, 2005; Chu, Fan, Lin & Wang, Int. J. Control 77(8), 2004), refined by Newton's
// method (Kleinman, IEEE Trans. Autom. Control 13, 1968; Hewer, ibid. 16, 1971).
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

struct RiccatiProblem {
  Mat A, B;  ///< n×n, n×m
  Mat Q, R;  ///< n×n symmetric; m×m symmetric positive definite, in discrete time semidefinite
  Mat S;     ///< n×m; empty: 0
  bool continuous = true;
};

struct RiccatiSolution {
  Mat X, K;             ///< n×n, m×n
  ComplexVec poles;     ///< eigenvalues of A - B K
  double residual = 0;  ///< ‖equation‖ / ‖its largest term‖
};

/// throws  Error on wrong sizes, Q or R not symmetric, R not definite as required, a
///         pair (A, B) that cannot be
/// stabilised (naming the mode), modes on the stability boundary that Q does not see
RiccatiSolution riccati(RiccatiProblem p);

/// A regulator needs costs that are not negative, the equation alone has solutions for others, too.
/// Throws Error that names `equation`
void require_costs(const Mat& Q, const char* equation);

/// x ↦ u = -K x of the linear-quadratic regulator with integrators of the outputs: u = -K [x; ∫(r - y)].
RiccatiSolution lqi(const System& g, const Mat& Q, const Mat& R);

/// The stationary Kalman filter of x⁺ = A x + B u + w, y = C x + D u + v with covariances Q of w (n×n), R of
/// v (p×p): by duality L = Kᵀ of riccati(Aᵀ, Cᵀ, Q, R). In discrete time L is the gain of the predictor,
/// x̂(t+1|t) = A x̂(t|t-1) + B u + L (y - C x̂ - D u).
RiccatiSolution kalman(const System& g, const Mat& Q, const Mat& R);
/// The filter as a system with the inputs u, y and the outputs ŷ, x̂.
System estimator(const System& g, const Mat& L);

}  // namespace pendula::lti
