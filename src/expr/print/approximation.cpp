#include "expr/print/approximation.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/cancellation.hpp"

namespace pendula {

std::string decimal_approximation(Expr e) {
  if (e.is_constant()) return "";
  for (Expr node : topological({&e, 1}))
    if (node.op() == Op::call || (node.is_symbol() && symbol_of(node).kind != Kind::constant)) return "";
  try {
    const double value = value_without_cancellation(e, {}).value_or(evaluate({&e, 1}, {})[0]);
    return std::isfinite(value) ? "≈ " + rounded(value, 10) : "";
  } catch (const Error&) {  // a singular linear system
    return "";
  }
}

}  // namespace pendula
