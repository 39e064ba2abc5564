// G(iω), or G(e^{iωTs}): Bode and Nyquist curves, margins, norms.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

/// Frequencies in rad/s from a decade below the slowest to a decade above the fastest pole or zero, denser
/// around lightly damped ones; in discrete time up to π/Ts.
Vec bode_frequencies(const System& g);

struct FrequencyResponse {
  SystemPtr system;
  Vec w;
  std::vector<ComplexVec> G;  ///< by channel: outputs × inputs, row by row
  double delay = 0;           ///< of a system times one delay: what it turns the phase by, in seconds
  bool delayed = false;       ///< margins of `system` are not those of this response
  bool sheet_known = true;    ///< poles and zeros of `system` (and delay) say which sheet the phase is on
  const ComplexVec& channel(int i, int j) const;
};
FrequencyResponse frequency_response(const System& g, const Vec& w);
/// Degrees, unwrapped along the points of one curve, beginning in (-180, 180].
Vec phase(const ComplexVec& G);
/// Degrees of one channel on the sheet that its poles and zeros give: at low frequencies 0 or ±180
/// minus 90 per integrator (1/s²: -180; a negative static gain: +180, or -180 where an odd number of
/// poles is unstable), then continuous in ω, whatever the distance of the frequencies. Systems of
/// more than 60 states: unwrapped.
Vec phase(const FrequencyResponse& r, int i, int j);
inline Vec decibels(const ComplexVec& G) { return 20 * G.cwiseAbs().array().log10(); }

/// Gain margin: 1/|G| where the phase crosses -180° (mod 360°); phase margin: 180° + phase where |G| = 1. The
/// smallest of each; nothing where the curve does not cross. For y = G/(1+G) r.
struct Margins {
  std::optional<double> gain, gain_at, phase, phase_at;
  bool closed_loop_stable = false;
};
/// throws  Error unless there is one input and one output
Margins margins(const System& g);
std::string describe(const Margins& m);

/// √(trace C P Cᵀ); infinite where D ≠ 0 in continuous time (an Error says so). Requires a stable system.
double h2_norm(const System& g);
/// max over ω of the largest singular value of G(iω), and where: bisection on the Hamiltonian matrix (Boyd,
/// Balakrishnan & Kabamba, Math. Control Signals Systems 2, 1989) in continuous time; discrete systems by the
/// bilinear transformation.
struct PeakGain {
  double value, at;
};
PeakGain hinf_norm(const System& g);

}  // namespace pendula::lti
