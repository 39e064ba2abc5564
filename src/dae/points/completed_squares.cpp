#include "dae/points/completed_squares.hpp"

#include <algorithm>

#include "expr/generic/generic.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {

/// A quick test before an expression is simplified, which may take a second.
static bool is_constant_in_general(Expr e) {
  const auto inside = leaves({&e, 1});
  return std::all_of(inside.begin(), inside.end(),
                     [&](Expr leaf) { return generic::is_zero(partial(e, leaf)); });
}

std::optional<Expr> with_completed_squares(Expr e) {
  constexpr std::size_t most_unknowns = 8, longest = 300;  // nodes
  const auto nodes = topological({&e, 1});
  const bool has_square = std::any_of(nodes.begin(), nodes.end(), [](Expr n) {
    return (n.op() == Op::mul && n.operand(0) == n.operand(1)) ||
           (n.op() == Op::pow && n.operand(1) == Expr(2));
  });
  if (!has_square || nodes.size() > longest) return {};
  const std::vector<Expr> unknowns = leaves({&e, 1});
  if (unknowns.size() > most_unknowns) return {};
  Expr squares = 0, rest = e;
  for (Expr x : unknowns) {
    const Expr slope = partial(rest, x), curvature = partial(slope, x);
    if (!is_constant_in_general(curvature)) continue;
    const Expr twice = simplify(curvature);
    if (!exact_value(twice) || twice.is_zero()) continue;
    const Expr at_zero = simplify(substitute(slope, {{x, Expr(0)}}));
    squares += twice / Expr(2) * pow(x + at_zero / twice, 2);
    rest = simplify(substitute(rest, {{x, Expr(0)}}) - at_zero * at_zero / (Expr(2) * twice));
  }
  return squares.is_zero() ? std::nullopt : std::optional(squares + rest);
}

}  // namespace pendula::dae
