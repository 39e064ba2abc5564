// Expressions that differ in the names of their variables are simplified once and renamed.
#include "expr/rewrite/rewrite_patterns.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>

#include "expr/graph/derivative.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::rewrite_patterns_test {

namespace {

std::vector<Expr> variables(const std::string& stem, int count) {
  std::vector<Expr> list;
  for (int i = 0; i < count; ++i) list.push_back(symbol(Kind::variable, stem + std::to_string(i)));
  return list;
}

/// A link of a chain: what differentiating |d|² twice leaves, in these variables.
Expr link(Expr x, Expr y, Expr u, Expr v) {
  return (x - y) * (derivative_leaf(u) - derivative_leaf(v)) + (u - v) * (u - v) + 2 * (x - y) * u -
         2 * x * (u - v) + x * x - x * x;
}

Expr random_expression(std::mt19937_64& random, const std::vector<Expr>& leaves, int depth) {
  const auto any = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  if (depth == 0) return any(5) == 0 ? Expr(static_cast<long>(any(4)) - 1) : leaves[any(leaves.size())];
  const Expr a = random_expression(random, leaves, depth - 1),
             b = random_expression(random, leaves, depth - 1);
  switch (any(7)) {
    case 0:
    case 1:
      return a + b;
    case 2:
      return a - b;
    case 3:
    case 4:
      return a * b;
    case 5:
      return sin(a) * b;
    default:
      return a * a - b;
  }
}

}  // namespace

TEST_CASE("patterns: equal for other variables in the same order, different otherwise") {
  const Expr two = 2;  // operands stand in the order in which nodes were made: made before both expressions
  REQUIRE(two.is_constant());
  const auto a = variables("pata", 4), b = variables("patb", 4);
  const auto key = [](Expr e) { return pattern_of(e)->key; };
  const Expr k = symbol(Kind::parameter, "patk"), l = symbol(Kind::parameter, "patl");
  const auto of = [&](const std::vector<Expr>& x, Expr p) {
    return p * link(x[0], x[1], x[2], x[3]) + x[0] * x[3];
  };
  CHECK(key(of(a, k)) == key(of(b, k)));
  CHECK(key(of(a, k)) != key(of(a, l)));                         // parameters have names
  CHECK(key(of(a, k)) != key(of({a[1], a[0], a[2], a[3]}, k)));  // declared in another order
  CHECK(key(of(a, k)) != key(of({a[0], a[1], a[2], a[2]}, k)));  // fewer variables
  CHECK(key(of(a, k)) != key(substitute(of(a, k), {{a[2], derivative_leaf(a[2])}})));
  CHECK(pattern_of(of(a, k))->variables == a);
  CHECK_FALSE(pattern_of(a[0] + a[1]).has_value());  // quicker without
  CHECK_FALSE(pattern_of(link(a[0], a[1], a[2], a[3]) * call({"patg", {1}, {0}, {a[0]}})).has_value());
}

TEST_CASE("patterns: the simple form of a renamed expression is the renamed simple form") {
  const auto a = variables("patc", 4), b = variables("patd", 4);
  const Expr first = simplify(link(a[0], a[1], a[2], a[3])), second = simplify(link(b[0], b[1], b[2], b[3]));
  Substitution renamed;
  for (std::size_t i = 0; i < a.size(); ++i) {
    renamed[a[i]] = b[i];
    renamed[derivative_leaf(a[i])] = derivative_leaf(b[i]);
  }
  CHECK(substitute(first, renamed) == second);
}

TEST_CASE("patterns: renamed random expressions keep their value, and simplify stays idempotent") {
  const auto a = variables("pate", 3), b = variables("patf", 3), c = variables("patg", 3);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> draw(-1.5, 1.5);
  for (int seed = 0; seed < 150; ++seed) {
    std::vector<Expr> leaves = a;
    leaves.push_back(derivative_leaf(a[0]));
    leaves.push_back(derivative_leaf(a[2]));
    const Expr e = random_expression(random, leaves, 2 + seed % 3);
    (void)simplify(e);
    for (const auto& list : {b, std::vector<Expr>{c[2], c[0], c[1]}}) {
      Substitution renamed;
      std::unordered_map<Expr, double> at;
      for (std::size_t i = 0; i < a.size(); ++i) {
        renamed[a[i]] = list[i];
        renamed[derivative_leaf(a[i])] = derivative_leaf(list[i]);
        at[list[i]] = draw(random);
        at[derivative_leaf(list[i])] = draw(random);
      }
      const Expr other = substitute(e, renamed), simple = simplify(other);
      CAPTURE(seed);
      const double value = evaluate({&other, 1}, at)[0], again = evaluate({&simple, 1}, at)[0];
      CHECK(std::fabs(value - again) <= 1e-11 * (1 + std::fabs(value)));  // |leaves| ≤ 1.5, degree ≤ 16
      CHECK(simplify(simple) == simple);
    }
  }
}

}  // namespace pendula::rewrite_patterns_test
