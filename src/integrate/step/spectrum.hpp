// How fast the parts of a solution are at a point: eigenvalues of ∂x′/∂x, roughly.
#pragma once

#include <optional>

#include "integrate/problem/rhs_solver.hpp"

namespace pendula::integrate {

/// In 1/unit of time; 0 where there is none.
struct Rates {
  double fastest = 0;  ///< the largest |λ|
  double damped = 0;   ///< the largest -Re λ of an eigenvalue with |Re λ| > |λ|/2
  double growing = 0;  ///< the largest Re λ
};

/// Of all eigenvalues of a small model, of the Ritz values of a Krylov space of a large one (Arnoldi 1951;
/// Saad, Numerical Methods for Large Eigenvalue Problems, 2nd ed., §6.2): those of largest size come out
/// within some ten percent. Products with the Jacobian are differences of x′, as in Sommeijer, Shampine &
/// Verwer, RKC: An explicit solver for parabolic PDEs, J. Comput. Appl. Math. 88, 1998, §3.
///
/// requires  x′ of `at` follows from its t and x
/// returns   nothing where x′ cannot be evaluated near the point, or the eigenvalues do not converge
/// cost      up to 12 states one evaluation of x′ each, beyond 12; eigenvalues of a matrix of that size, less
///           the rows that are alone (20 × 20: 0.27 M instructions, as much as four steps of Radau IIA),
///           unless a norm of the matrix is below `harmless`: then all three are that norm
std::optional<Rates> rates(RhsSolver& derivative, const Point& at, double harmless = 0);

/// The largest |λ| along a solution by the power method, started with the vector of the last point
/// (Sommeijer, Shampine & Verwer, ibid. §3.2); much cheaper than rates(). Too small by some ten percent where
/// it has not converged; for a complex pair it oscillates about |λ|.
class SpectralRadius {
 public:
  /// requires  x′ of `at` follows from its t and x
  /// cost      four evaluations of x′ at the first point, then two
  std::optional<double> at(RhsSolver& derivative, const Point& at);

 private:
  Vec direction_, any_, ahead_;
};

}  // namespace pendula::integrate
