#include "dae/points/generic_functions.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {
namespace {

bool has_calls(const std::vector<Expr>& e) {
  const auto nodes = topological(e);
  return std::any_of(nodes.begin(), nodes.end(), [](Expr n) { return n.op() == Op::call; });
}

/// A smooth function of the same arguments without special properties: terms of second degree and a sine.
Expr generic_function(const FunctionCall& f) {
  std::size_t state = std::hash<std::string>()(f.name);
  const auto draw = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return Expr(mpq_class(static_cast<long>((state >> 33) % 89) + 11, 60));
  };
  std::vector<Expr> slots;
  Expr phase = draw(), sum = draw();
  for (std::size_t i = 0; i < f.arguments.size(); ++i) {
    const Expr s = symbol(Kind::slot, text("arg_", i));
    phase += draw() * s;
    sum += draw() * s + draw() / Expr(7) * s * s;
    if (i > 0) sum += draw() / Expr(5) * s * slots.back();
    slots.push_back(s);
  }
  sum += sin(phase);
  for (std::size_t i = 0; i < slots.size(); ++i)
    for (int k = 0; k < f.partial[i]; ++k) sum = partial(sum, slots[i]);
  Substitution arguments;
  for (std::size_t i = 0; i < slots.size(); ++i) arguments[slots[i]] = f.arguments[i];
  return substitute(sum, arguments);
}

}  // namespace

std::vector<Expr> without_calls(std::vector<Expr> e) {
  while (has_calls(e)) {
    Substitution innermost;
    for (Expr node : topological(e))
      if (node.op() == Op::call && !has_calls(call_of(node).arguments))
        innermost[node] = generic_function(call_of(node));
    e = substitute(e, innermost);
  }
  return e;
}

}  // namespace pendula::dae
