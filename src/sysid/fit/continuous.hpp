// Transfer functions in continuous time against sampled data: G(s) = b(s)/a(s) e^{-Ls}, the input constant
// between samples, y(t) = G u + e (output error).
#pragma once

#include "sysid/data/iddata.hpp"

namespace pendula::sysid {

struct ContinuousModel {
  Vec num, den;  ///< highest power first, deg num ≤ deg den
  double delay = 0;
};

/// The output at the samples, exact: x⁺ = e^{ATs} x + Γ₁ u(k-d-1) + Γ₀ u(k-d), L = (d + f) Ts, with the parts
/// of the sample before and after the input switches (Åström & Wittenmark, Computer-Controlled Systems, 3rd
/// ed., §3.3). Before the first sample u is its first value where `settled`, else 0.
/// requires  den[0] ≠ 0, deg num ≤ deg den (and < where L > 0 is not a multiple of Ts), L ≥ 0
Vec simulate_held(const ContinuousModel& m, const Vec& u, double Ts, bool settled = false);

/// y - G u of one input and output; samples that are missing are left out. free: the initial state is fitted.
/// A model that is not finite on the data gives NaN.
Vec continuous_errors(const ContinuousModel& m, const IdData& d, bool free);

}  // namespace pendula::sysid
