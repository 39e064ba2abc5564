// e^{At}, exact where it can be, and the response it gives. docs/derivations.md#matrix-exponential.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

/// e^{A t} for a symbol, number or expression t. Exact for rational A whose characteristic polynomial
/// has linear and quadratic factors (decimals in the others), for nilpotent A, for A = R s with
/// rational R, for triangular A, and for symbolic 2×2 matrices whose discriminant has one sign for
/// positive symbols. Nothing otherwise.
std::optional<MatX> transition(const MatX& A, Expr t);
/// e^A: the same with every scalar factor in A; nothing where there is no exact form.
std::optional<MatX> exponential(const MatX& A);

/// x(t) = e^{At} x₀ + ∫₀ᵗ e^{A(t-τ)} B u(τ) dτ for t ≥ 0 (Kailath, Linear Systems, 1980, ch. 2).
///
/// x0, u     expressions of parameters, and of t; u: polynomials, exponentials, sines
///           and cosines and their products
/// returns   exact expressions in t where modes are rational or quadratic (rational
///           A), or e^{At} has a symbolic form
/// throws    Error in discrete time; for inputs of another kind, naming the part; for symbolic resonance
VecX solution(const System& g, const VecX& x0, const VecX& u);

}  // namespace pendula::lti
