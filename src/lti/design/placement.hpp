// Pole placement: K with prescribed eigenvalues of A - B K.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

struct Placement {
  Mat K;                 ///< m×n
  ComplexVec poles;      ///< eigenvalues of A - B K as computed
  double condition = 1;  ///< of their eigenvectors: how much a perturbation of A or B moves the poles
};

/// Robust placement: of all K with these poles one whose eigenvectors are far from dependent, by
/// rank-one updates of real (Kautsky, Nichols & Van Dooren, Int. J. Control 41(5), 1985, method 0)
/// and rank-two updates of complex eigenvectors (Tits & Yang, IEEE Trans. Autom. Control 41(10),
/// 1996). With one input K is unique.
/// poles   n numbers, complex ones with their conjugates
/// throws  Error on sizes, poles without conjugate, poles repeated more often than B has rank, uncontrollable
///         (A, B), naming the mode; Failure where rounding moves the poles by more than 0.1 %
Placement place(const Mat& A, const Mat& B, const ComplexVec& poles);

/// Ackermann's formula K = [0 … 0 1] [B AB … Aⁿ⁻¹B]⁻¹ φ(A), one input: exact and symbolic entries stay so.
/// φ       1, c₁, …, cₙ with φ(s) = sⁿ + c₁sⁿ⁻¹ + … + cₙ
MatX acker(const MatX& A, const MatX& B, const std::vector<Expr>& polynomial);

}  // namespace pendula::lti
