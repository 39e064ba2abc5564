#include "expr/graph/taylor.hpp"

#include <algorithm>

#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"

namespace pendula {

static mpq_class factorial(int k) {
  mpz_class product = 1;
  for (int i = 2; i <= k; ++i) product *= i;
  return mpq_class(product);
}

Expr TaylorSeries::derivative(Expr e, int k) {
  for (int order = 0; order <= k; ++order)
    for (Expr node : topological({&e, 1})) {  // operands first, which keeps the recursion shallow
      poll_interrupt();
      coefficient(node, order);
    }
  return Expr(factorial(k)) * coefficient(e, k);
}

Expr TaylorSeries::coefficient(Expr e, int k) {
  check_stack();
  if (e.is_constant()) return k == 0 ? e : Expr(0);
  const auto known = [&] { return static_cast<int>(series_[e].size()); };
  for (int order = known(); order <= k; ++order) {
    const Expr next = e.is_symbol() ? leaf_coefficient(e, order) : operation_coefficient(e, order);
    if (known() == order) series_[e].push_back(next);
  }
  return series_[e][k];
}

Expr TaylorSeries::leaf_coefficient(Expr leaf, int k) {
  if (const auto own = rates_.find(leaf); own != rates_.end()) return coefficient(own->second, k);
  if (k == 0) return leaf;
  const Symbol& s = symbol_of(leaf);
  if (s.kind == Kind::time) return Expr(k == 1 ? 1 : 0);
  if (s.kind != Kind::variable && s.kind != Kind::input) return Expr(0);
  return coefficient(derivative_leaf(leaf), k - 1) / Expr(k);
}

Expr TaylorSeries::operation_coefficient(Expr e, int k) {
  const auto x = e.operands();
  if (k == 0) {
    if (e.op() == Op::call) return substitute(e, rates_);
    const auto of = [&](std::size_t i) { return i < x.size() ? coefficient(x[i], 0) : Expr(0); };
    return make(e.op(), of(0), of(1), of(2));
  }
  switch (e.op()) {
    case Op::neg:
      return -coefficient(x[0], k);
    case Op::add:
      return coefficient(x[0], k) + coefficient(x[1], k);
    case Op::sub:
      return coefficient(x[0], k) - coefficient(x[1], k);
    case Op::mul: {
      Expr sum;
      for (int i = 0; i <= k; ++i) sum += coefficient(x[0], i) * coefficient(x[1], k - i);
      return sum;
    }
    case Op::div: {  // a = r b
      Expr rest = coefficient(x[0], k);
      for (int i = 1; i <= k; ++i) rest -= coefficient(x[1], i) * coefficient(e, k - i);
      return rest / coefficient(x[1], 0);
    }
    default: {
      Expr sum;
      for (std::size_t j = 0; j < x.size(); ++j) {
        const Expr slope = local_derivative(e, static_cast<int>(j));
        for (int i = 1; i <= k && !slope.is_zero(); ++i)
          if (const Expr a = coefficient(x[j], i); !a.is_zero())
            sum += Expr(i) / Expr(k) * a * coefficient(slope, k - i);
      }
      return sum;
    }
  }
}

bool prefers_series(Expr e, Expr before, int k) {
  // choices: low derivatives and short expressions are wanted in the usual form
  constexpr int low = 3;
  constexpr std::size_t readable = 100;  // nodes
  if (k <= low || topological({&before, 1}).size() <= readable) return false;
  const auto nodes = topological({&e, 1});
  return std::none_of(nodes.begin(), nodes.end(), [](Expr node) { return node.op() == Op::solve; });
}

}  // namespace pendula
