// Balanced realisations and the reduction of stable systems.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

/// x = T x̃ with equal diagonal Gramians diag(σ) in x̃ (Laub, Heath, Paige & Ward, IEEE Trans. Autom. Control
/// 32(2), 1987, square-root method). σ: the Hankel singular values, largest first.
struct Balanced {
  System system;
  Vec hankel;
  Mat T;
};
/// throws  Error unless the system is asymptotically stable and minimal
Balanced balanced(const System& g);

/// The first `order` balanced states. "truncate": the others are left out, exact at s = ∞; "dc": their
/// derivatives are zero (in discrete time x̃⁺ = x̃), which keeps G(0). ‖G - Gᵣ‖_∞ ≤ 2 Σ σₖ over the others
/// (Glover, Int. J. Control 39(6), 1984). Works for systems that are not minimal, too.
struct Reduction {
  System system;
  Vec hankel;
  double bound = 0;
};
Reduction reduced(const System& g, int order, const std::string& method);

}  // namespace pendula::lti
