// Continuous to discrete time and back.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

/// The names of sampling methods: "zoh", "foh", "tustin" (or "bilinear"), "euler",
/// "backward", "impulse", "matched".
const std::vector<std::string>& sampling_methods();

/// zoh: inputs constant between samples; foh: linear (triangle hold); tustin: s = 2/Ts (z-1)/(z+1); euler,
/// backward: difference quotients; impulse: the impulse response is sampled; matched: poles and zeros go to
/// e^{s Ts}. With `prewarp` > 0 tustin is exact at that frequency in rad/s. Exact where entries stay
/// rational or are symbolic, doubles otherwise. Åström & Wittenmark, Computer-Controlled Systems, 3rd ed.,
/// ch. 2 and 8; Franklin, Powell & Workman, Digital Control, §6.3. Throws Error for systems that are
/// discrete already, Ts ≤ 0, unknown methods
System c2d(const System& g, Expr Ts, const std::string& method = "zoh", double prewarp = 0);

/// "zoh" (matrix logarithm) or "tustin". Throws Error where poles are 0 or on the
/// negative axis (zoh), or -1 (tustin)
System d2c(const System& g, const std::string& method = "zoh");

}  // namespace pendula::lti
