// Random expressions over every operation of ops.def, and a comparison of their
// values that knows about rounding.
#pragma once

#include <cmath>
#include <random>
#include <unordered_map>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula {

class RandomExpressions {
 public:
  explicit RandomExpressions(unsigned seed) : random_(seed) {
    for (const char* name : {"rx", "ry", "rz"}) leaves_.push_back(symbol(Kind::variable, name));
    for (const char* name : {"ra", "rb"}) leaves_.push_back(symbol(Kind::parameter, name));
    leaves_.push_back(derivative_leaf(leaves_[0]));
  }

  int pick(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }

  Expr expression(int depth) {
    if (depth == 0) {
      static const Expr numbers[] = {2, 3, Expr(-1), Expr(0.5), Expr(1) / 3, Expr(9.81)};
      return pick(4) == 0 ? numbers[pick(6)] : leaves_[pick(6)];
    }
    // Half of the operations are arithmetic, or nothing would ever cancel.
    static constexpr Op arithmetic[] = {Op::add, Op::sub, Op::mul, Op::div, Op::neg};
    const int operations = static_cast<int>(end_op) - static_cast<int>(first_op);
    const Op op =
        pick(2) ? arithmetic[pick(5)] : static_cast<Op>(static_cast<int>(first_op) + pick(operations));
    const Expr a = expression(pick(depth)), b = expression(pick(depth)), c = expression(pick(depth));
    try {
      if (op == Op::pow) return pow(a, pick(3) ? Expr(pick(7) - 3) : pick(2) ? Expr(pick(5) - 2) / 2 : b);
      const int arity = info(op).arity;
      return make(op, a, arity > 1 ? b : Expr(0), arity > 2 ? c : Expr(0));
    } catch (const Error&) {  // 1/0 and the like: not an expression
      return a;
    }
  }

  std::unordered_map<Expr, double> point() {
    std::unordered_map<Expr, double> at;
    for (Expr leaf : leaves_) at[leaf] = std::uniform_real_distribution<>(-2, 2)(random_);
    return at;
  }

 private:
  std::mt19937 random_;
  std::vector<Expr> leaves_;
};

/// The value where it is defined and well-conditioned: it must barely change when the point moves by 1e-9.
inline std::optional<double> steady_value(Expr e, const std::unordered_map<Expr, double>& at) {
  const double value = evaluate({&e, 1}, at)[0];
  if (!std::isfinite(value) || std::fabs(value) > 1e6 || first_undefined(e, at)) return {};
  for (double shift : {1e-9, -1e-9}) {
    auto near = at;
    for (auto& [leaf, v] : near) v += shift;
    const double moved = evaluate({&e, 1}, near)[0];
    if (!(std::fabs(moved - value) <= 1e-6 * std::max(1.0, std::fabs(value)))) return {};
  }
  return value;
}

}  // namespace pendula
