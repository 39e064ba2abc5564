// Structure of linear systems: poles, zeros, controllability, minimal realisations,
// Gramians.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

/// States up to which characteristic polynomials are exact: for full matrices of small whole numbers poles
/// take 0.1 s, zeros and verdicts on stability 0.2 s.
inline constexpr int most_exact_states = 30;

/// Poles by real part, then imaginary part: eigenvalues of A, or of a minimal realisation of a
/// matrix of fractions (zeros of the denominator where there is one input and one output).
/// Exact where rational or quadratic.
std::vector<dae::Mode> poles(const System& g);
/// Invariant zeros: s at which [sI-A, -B; C, D] loses rank (for minimal systems the transmission zeros). By
/// successive compression of rows and columns (Emami-Naeini & Van Dooren, Automatica 18(4), 1982), exact for
/// rational systems; of a fraction the zeros of its numerator.
std::vector<dae::Mode> zeros(const System& g);

/// Symbolic poles of a polynomial of degree ≤ 2 in its last factor; nothing otherwise.
std::optional<std::vector<Expr>> symbolic_zeros(const Polynomial& p);
/// det(sI - A), or the denominator.
Polynomial characteristic(const System& g);

/// [B, AB, …, Aⁿ⁻¹B] and [C; CA; …; CAⁿ⁻¹].
MatX controllability_matrix(const System& g);
MatX observability_matrix(const System& g);

/// Modes that inputs cannot reach, or outputs cannot observe.
struct Reach {
  bool controllability = true;  ///< else observability
  int order = 0, rank = 0;
  struct Hidden {
    dae::Mode mode;
    std::string text;  ///< the combination of states that moves by itself, or the direction that is not seen
  };
  std::vector<Hidden> modes;  ///< empty where rank = order, or unknown for symbolic systems
  bool stable = true;         ///< all hidden modes are: the system is stabilizable (detectable)
  SystemPtr system;
};
/// By the rank of the matrix [B, AB, …] (exact), or, in doubles, by the staircase algorithm with a
/// tolerance; the hidden modes are those of the quotient by the reachable subspace
/// (Popov–Belevitch–Hautus test, Kailath §2.4.3).
Reach controllability(const System& g);
Reach observability(const System& g);
/// [B, AB, …] or [C; CA; …]. Throws Failure where its entries overflow
MatX matrix(const Reach& r);
std::string describe(const Reach& r);

/// Without uncontrollable and unobservable modes (Kalman decomposition), fractions without common factors.
/// `tol`: two zeros of numeric fractions cancel when closer than tol·|z|; in state space directions smaller
/// than tol relative to ‖A‖ and ‖B‖ (‖C‖) do not count. 0: 1e-8 for fractions, n·1e-12 in state space; exact
/// numbers are then compared exactly. The notes say what was removed.
System minimal(const System& g, double tol);

/// A P + P Aᵀ + Q = 0, or A P Aᵀ - P + Q = 0 in discrete time: exact for small rational
/// matrices, else by the complex Schur form (Bartels & Stewart, Comm. ACM 15(9), 1972). Throws
/// Error where the solution is not unique
MatX lyapunov(const MatX& A, const MatX& Q, bool continuous);
/// Controllability or observability Gramian. Throws Error unless the system is asymptotically stable
MatX gramian(const System& g, bool controllability);

struct Stability {
  std::string verdict;      ///< "asymptotically stable", "stable, not asymptotically", "unstable"
  std::string reason;       ///< the poles that decide
  std::vector<Expr> routh;  ///< symbolic systems: first column of Routh's array; stable ⇔ all of one sign
  bool asymptotic = false, symbolic = false;
};
/// throws  Error for symbolic systems in discrete time without values
Stability stability(const System& g);
std::string describe(const Stability& s);

/// First column of Routh's array, highest power first. Throws Error where a pivot vanishes
std::vector<Expr> routh(const Polynomial& p);

}  // namespace pendula::lti
