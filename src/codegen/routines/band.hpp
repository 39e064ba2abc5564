// Symmetric definite matrices with few diagonals, such as the constraints of a chain leave behind: A = L D Lᵀ
// without pivoting, stable for them in any order of elimination (Higham, Accuracy and Stability of Numerical
// Algorithms, 2nd ed., §10.1), in memory order and in O(n).
//
// Every step waits for the pivot before it. With one diagonal below the main one elimination therefore runs
// from both ends towards the middle (Babuška, SIAM J. Numer. Anal. 9, 1972), two independent chains of
// operations side by side with no more of them than from one end.
#pragma once

namespace pendula::codegen {

/// a: band + 1 times n numbers, A(i, i - d) at [d·n + i] (anything where i < d). They become the factors, the
/// same number. Requires n ≥ 1, band ≥ 1; a zero pivot gives infinities.
void band_factor(double* a, int n, int band);
/// b becomes A⁻¹ b. factors: the result of band_factor.
void band_solve(double* b, int n, const double* factors, int band);

}  // namespace pendula::codegen
