// Derivatives against central differences: every operation of ops.def, then random expressions.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/graph.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::derivative_test {

using Point = std::unordered_map<Expr, double>;

namespace {

const Expr a = symbol(Kind::variable, "da"), b = symbol(Kind::variable, "db"),
           c = symbol(Kind::variable, "dc");
const std::vector<Expr> abc = {a, b, c};

double value(Expr e, const Point& at) { return evaluate({&e, 1}, at)[0]; }

/// Fourth-order central difference.
double difference(Expr e, Expr leaf, Point at) {
  const double h = 1e-4, x = at[leaf];
  const auto f = [&](double shift) {
    at[leaf] = x + shift;
    return value(e, at);
  };
  return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
}

/// A random expression of the smooth operations; every value stays moderate.
Expr random_expression(std::mt19937& random, int depth) {
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  if (depth == 0) return pick(4) == 0 ? Expr(pick(5) + 1) : abc[pick(3)];
  const Expr u = random_expression(random, depth - 1), v = random_expression(random, depth - 1);
  switch (pick(10)) {
    case 0:
      return u + v;
    case 1:
      return u - v;
    case 2:
      return sin(u) * cos(v);
    case 3:
      return u / (Expr(2) + v * v);
    case 4:
      return sin(u * v);
    case 5:
      return exp(-(sin(u) * sin(u)));
    case 6:
      return log(Expr(1) + u * u);
    case 7:
      return sqrt(Expr(1) + u * u);
    case 8:
      return atan(u) * v;
    default:
      return pow(Expr(2) + cos(u), 3);
  }
}

}  // namespace

TEST_CASE("every operation: its partial derivatives against central differences, inside its domain") {
  std::mt19937 random(7);
  for (Op op = first_op; op < end_op; op = next(op)) {
    const OpInfo& row = info(op);
    CAPTURE(row.name);
    const Expr e = make(op, abc[0], row.arity > 1 ? abc[1] : Expr(0), row.arity > 2 ? abc[2] : Expr(0));
    std::uniform_real_distribution<double> draw(row.lo, row.hi);
    for (int trial = 0; trial < 20; ++trial) {
      Point at = {{a, draw(random)}, {b, draw(random)}, {c, draw(random)}};
      const bool kink =
          (op == Op::min || op == Op::max || row.style == Style::cond) && std::fabs(at[a] - at[b]) < 0.01;
      const bool condition = op == Op::ifelse || row.style == Style::cond;
      if (kink || (condition && (std::fabs(at[a]) < 0.01 || std::fabs(at[b]) < 0.01))) continue;
      for (int i = 0; i < row.arity; ++i) {
        CAPTURE(i);
        const double exact = value(partial(e, abc[i]), at);
        // h⁴·f⁽⁵⁾/30 is far below rounding, which leaves about 1e-16/h of the value.
        CHECK(exact == doctest::Approx(difference(e, abc[i], at)).epsilon(1e-7));
      }
    }
  }
}

TEST_CASE("random expressions: gradient = forward mode = differences; the Hessian is symmetric") {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const Expr e = random_expression(random, 4);
    const Point at = {{a, 0.3}, {b, -0.7}, {c, 1.1}};
    const auto g = gradient(e, abc);
    const MatX h = jacobian(g, abc);
    for (int i = 0; i < 3; ++i) {
      const double exact = value(g[i], at);
      const double scale = 1 + std::fabs(exact);
      CHECK(std::fabs(exact - value(partial(e, abc[i]), at)) <= 1e-12 * scale);
      // Nested functions have large fifth derivatives: h⁴ = 1e-16 of them is what the tolerance covers.
      CHECK(std::fabs(exact - difference(e, abc[i], at)) <= 1e-5 * scale);
      for (int j = 0; j < i; ++j) {
        const double left = value(h(i, j), at), right = value(h(j, i), at);
        CHECK(std::fabs(left - right) <= 1e-10 * (1 + std::fabs(left)));
      }
    }
  }
}

TEST_CASE("the sparse Jacobian is the dense one without its zeros") {
  std::mt19937 random(3);
  std::vector<Expr> f;
  for (int i = 0; i < 5; ++i) f.push_back(random_expression(random, 3));
  f.push_back(sin(b));
  MatX dense = jacobian(f, abc);
  for (const Entry& entry : sparse_jacobian(f, abc)) {
    CHECK(dense(entry.row, entry.column) == entry.value);
    dense(entry.row, entry.column) = 0;
  }
  for (Expr rest : entries(dense)) CHECK(rest.is_zero());
}

TEST_CASE("roots cancel: a derivative has a value where its base is 0, if the function has one") {
  const Expr m = max(a, Expr(0)), p = Expr(mpq_class(3, 10)), g = b * m + 2;
  const std::vector<Expr> functions = {m * sqrt(m),
                                       b * m * sqrt(m) * c,
                                       pow(m, 2) * sqrt(m),
                                       m * pow(m, p),
                                       m / (1 + sqrt(m)),
                                       pow(pow(m, Expr(0.7)), Expr(2)),
                                       m * (sqrt(m) + b),
                                       (m + c * m) * sqrt(m) - m,
                                       pow(sqrt(m), Expr(3)) * b,
                                       -m * sqrt(m) / (c + sqrt(m)),
                                       m * sqrt(m) + g * g};
  for (std::size_t k = 0; k < functions.size(); ++k) {
    CAPTURE(k);
    const Expr f = functions[k], by_reverse = gradient(f, {&a, 1})[0], by_forward = partial(f, a);
    const Point inside = {{a, 0.3}, {b, 0.7}, {c, 1.1}}, border = {{a, -0.5}, {b, 0.7}, {c, 1.1}};
    CHECK(value(by_reverse, inside) == doctest::Approx(difference(f, a, inside)).epsilon(1e-9));
    CHECK(value(by_forward, inside) == doctest::Approx(difference(f, a, inside)).epsilon(1e-9));
    CHECK(value(by_reverse, border) == 0);  // f is constant for a < 0
    CHECK(value(by_forward, border) == 0);
  }
  CHECK_FALSE(std::isfinite(value(partial(sqrt(m), a), {{a, 0.0}})));  // vertical there
}

TEST_CASE("a branch of min or max that is not chosen has no slope, even where the other factor is infinite") {
  const Point at = {{a, -0.5}, {b, 0.7}};
  for (Expr f : {sqrt(max(a, Expr(0))), b * sqrt(max(Expr(0), a)), asin(min(Expr(1), b - 2 * a)),
                 sqrt(max(a, Expr(0)) + max(a + a, Expr(0)))}) {
    CHECK(value(gradient(f, {&a, 1})[0], at) == 0);
    CHECK(value(partial(f, a), at) == 0);
  }
}

TEST_CASE("total derivatives follow the chain rule") {
  const Expr x = symbol(Kind::variable, "dx"), m = symbol(Kind::parameter, "dm"), t = time_symbol();
  CHECK(total_derivative(x) == derivative_leaf(x));
  CHECK(total_derivative(x, 2) == derivative_leaf(x, 2));
  CHECK(total_derivative(m).is_zero());
  CHECK(total_derivative(t).is_one());
  CHECK(total_derivative(sin(x)) == cos(x) * derivative_leaf(x));
  CHECK(partial(x * derivative_leaf(x), x) == derivative_leaf(x));  // x and x′ are independent leaves
}

TEST_CASE("formal partial derivatives of unspecified functions") {
  const Expr x = symbol(Kind::variable, "dx"), y = symbol(Kind::variable, "dy");
  const Expr g = call({"dg", {1, 1}, {0, 0}, {x, y}});
  const Expr gx = partial(g, x);
  CHECK(call_of(gx).partial == std::vector<int>{1, 0});
  CHECK(partial(gx, y) == partial(partial(g, y), x));
  CHECK(partial(call({"dg", {1, 1}, {0, 0}, {x * x, y}}), y) != partial(g, y));
  CHECK_THROWS_AS(evaluate({&g, 1}, {{x, 1.0}, {y, 1.0}}), Error);
}

TEST_CASE("substitution is simultaneous and refolds") {
  CHECK(substitute(a + b, {{a, b}, {b, a}}) == a + b);
  CHECK(substitute(sin(a) * b, {{sin(a), c}}) == c * b);
  CHECK(substitute(a * b, {{a, 0}}).is_zero());
  CHECK_THROWS_AS(substitute(Expr(1) / a, {{a, 0}}), Error);
}

TEST_CASE("first_undefined names the innermost culprit") {
  const Expr e = Expr(1) + sqrt(log(a));
  CHECK(first_undefined(e, {{a, 0.5}}) == sqrt(log(a)));
  CHECK(first_undefined(e, {{a, -1.0}}) == log(a));
  CHECK_FALSE(first_undefined(e, {{a, 2.0}}).has_value());
  CHECK_THROWS_AS(evaluate({&e, 1}, {}), Error);
}

}  // namespace pendula::derivative_test
