// Where equations as they are written are not defined: poles, and the borders of the domains of functions.
#pragma once

#include <string>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Where `factor` is 0, `term` is infinite (1/x, tan x) or, on one side of it, no number (log x, √x).
struct DomainCondition {
  Expr factor, term;
  bool pole;  ///< term is infinite there, and the factor may change its sign (|x|^(-1/2): x)

  /// "x = 0 there, and 1/x is not defined".
  std::string reason() const;
};

/// Of all terms of the equations, each factor once. Left out: factors without variables, and those that never
/// vanish by the signs of their parts (1 + x²). A condition need not matter to the
/// equations: sin(x)/x is bounded, the branch of an ifelse may not be in force.
/// Cost: linear in the size of the equations; factors of denominators are remembered.
std::vector<DomainCondition> domain_conditions(const std::vector<Expr>& equations);

}  // namespace pendula::dae
