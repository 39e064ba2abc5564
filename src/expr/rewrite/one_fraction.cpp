#include "expr/rewrite/one_fraction.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula {
namespace {

bool is_sum(Expr e) { return e.op() == Op::add || e.op() == Op::sub; }

bool has_sum(Expr e) {
  const auto nodes = topological({&e, 1});
  return std::any_of(nodes.begin(), nodes.end(), is_sum);
}

bool has_quotient(Expr e, bool by_sum_only) {
  for (Expr node : topological({&e, 1}))
    if (node.op() == Op::div && (!by_sum_only || is_sum(node.operands()[1]))) return true;
  return false;
}

/// Does a factor of numerator or denominator contain a sum with quotients?
bool is_nested(Expr e, bool below = false) {
  check_stack();
  switch (e.op()) {
    case Op::neg:
      return is_nested(e.operands()[0], below);
    case Op::mul:
      return is_nested(e.operands()[0], below) || is_nested(e.operands()[1], below);
    case Op::div:
      return is_nested(e.operands()[0], below) || is_nested(e.operands()[1], true);
    case Op::pow:
      return is_nested(e.operands()[0], below);
    case Op::add:
    case Op::sub:
      return has_quotient(e, !below);
    default:
      return false;
  }
}

/// Divides term by term if that is shorter: r θ′² - G (m₁ + m₂)/r² instead of (r³ θ′² - m₁ G - m₂ G)/r².
Expr divided(Expr fraction) {
  if (fraction.op() != Op::div || has_sum(fraction.operands()[1])) return fraction;
  const Expr terms = simplify(expand(fraction));
  return display_width(to_text(terms)) < display_width(to_text(fraction)) ? terms : fraction;
}

}  // namespace

Expr one_fraction(Expr e) {
  // operations: a choice; factors of larger expressions take longer than printing
  constexpr double longest = 400;
  if (!is_short(e, longest) || !is_nested(e)) return e;
  try {
    const Expr fraction = divided(simplify(factored(e)));
    const int before = display_width(to_text(e)), after = display_width(to_text(fraction));
    // a quotient in quotients is worth one that is half as long again
    const bool longer = is_sum(e) ? after > before : 2 * after > 3 * before + 40;
    return longer || is_nested(fraction) ? e : fraction;
  } catch (const Error&) {  // doubles, or no FLINT: e is unchanged
    return e;
  }
}

}  // namespace pendula
