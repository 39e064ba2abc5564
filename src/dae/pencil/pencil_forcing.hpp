// Functions of time that are sums of c tᵏ e^{at} cos(bt) and c tᵏ e^{at} sin(bt): closed under sums and
// products, and each the output of a linear system with constant coefficients.
#pragma once

#include <optional>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// tᵏ e^{at} (cosine · cos(bt) + sine · sin(bt)); a, b, cosine, sine do not contain t.
struct ForcingTerm {
  int power = 0;
  Expr rate, frequency;
  Expr cosine, sine;
};
using Forcing = std::vector<ForcingTerm>;

/// Nothing if e is not of that kind; `culprit`, if given, is then the part that is not.
std::optional<Forcing> forcing_of(Expr e, Expr* culprit = nullptr);

/// All terms of one rate and frequency: e^{at} (p(t) cos(bt) + q(t) sin(bt)).
struct ForcingGroup {
  Expr rate, frequency;
  std::vector<Expr> p, q;  ///< coefficients by power
};
std::vector<ForcingGroup> grouped(const Forcing& terms);

}  // namespace pendula::dae
