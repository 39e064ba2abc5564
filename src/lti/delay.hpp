// Linear systems with delays: a rational system G whose last k inputs are its last k
// outputs of some time ago,
//
//   [y; z] = G [u; w],  w_i(t) = z_i(t - τ_i),   G(s) = G₁₁ + G₁₂ Θ (I - G₂₂ Θ)⁻¹ G₂₁,  Θ = diag(e^{-τ_i s})
//
// (Skogestad & Postlethwaite, Multivariable Feedback Control, 2nd ed., §3.8, linear fractional
// transformations). A rational system times one delay is kept as such, also where it is improper.
#pragma once

#include "lti/frequency.hpp"
#include "lti/response.hpp"

namespace pendula::lti {

struct DelaySystem {
  System core;
  std::vector<double> delays;  ///< seconds, > 0; empty: no delay
  bool product = false;        ///< core · e^{-delays[0] s}: core has no further channels
  int inner() const { return product ? 0 : static_cast<int>(delays.size()); }
  int inputs() const { return core.inputs - inner(); }
  int outputs() const { return core.outputs - inner(); }
};

/// g e^{-delay s}. Throws Error for negative delays and systems in discrete time (there z⁻ᵈ is rational)
DelaySystem delayed(System g, double delay);
/// e^{g} of g = -T s, or a number. Throws Error for every other g
DelaySystem exponential_of(const System& g);

/// As a fractional transformation: of a product z = u, y = G w.
DelaySystem general(const DelaySystem& g);

/// A rational function of s and of delays e^{-T s}. Throws Error that names what is neither
DelaySystem delay_system_of(Expr e, Expr s);
/// Does e^{… s} occur in e?
bool has_delay(Expr e, Expr s);

DelaySystem series(const DelaySystem& second, const DelaySystem& first);
DelaySystem parallel(const DelaySystem& a, const DelaySystem& b);
DelaySystem negative(DelaySystem g);
DelaySystem feedback(const DelaySystem& g1, const DelaySystem& g2, int sign);
/// throws  Error for anything but a single delay times a rational system without delay in the denominator
DelaySystem inverse(const DelaySystem& g);

ComplexMat value(const DelaySystem& g, Complex s);
FrequencyResponse frequency_response(const DelaySystem& g, const Vec& w);
/// The frequencies of the rational part, up to where the longest delay turns the phase by ten turns at least.
Vec bode_frequencies(const DelaySystem& g);
/// Crossings on a grid that follows the phase; stable by the argument of 1 + G (Nyquist).
Margins margins(const DelaySystem& g);

/// Every delay as a Padé approximant of this order.
System rational(const DelaySystem& g, int order);
/// Zero-order hold, exact: the inputs that are under way become states (Åström & Wittenmark,
/// Computer-Controlled Systems, 3rd ed., §3.3). Throws Error where the delay lies in a loop, or G is improper
System sampled(const DelaySystem& g, double Ts);

/// Responses in time from rest, by the method of steps: between the times at which a jump can arrive,
/// collocation at eight Gauss points (order 16), delayed signals by interpolation at them.
Response step(const DelaySystem& g, const Vec& t);
/// u(t) is smooth except at `corners`.
Response simulate(const DelaySystem& g, const std::function<Vec(double)>& u, const Vec& t,
                  const std::vector<double>& corners);

std::string describe(const DelaySystem& g);

}  // namespace pendula::lti
