// The graph: interning, folding, exact constants, and its behaviour at scale.
#include <doctest/doctest.h>

#include <cmath>
#include <ctime>
#include <limits>

#include "base/error.hpp"
#include "codegen/kernel/kernel.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/graph.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::graph_test {

namespace {

const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");

std::string exact_text(double value) {
  const mpq_class* q = exact_value(Expr(value));
  return q ? q->get_str() : "not exact";
}

/// Of processor time: others on the machine do not count.
double seconds_since(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Σ of n blocks, each of a few operations on a variable and its neighbour.
std::vector<Expr> chain(int n) {
  std::vector<Expr> q, f;
  for (int i = 0; i < n; ++i) q.push_back(symbol(Kind::variable, "chain" + std::to_string(i)));
  for (int i = 0; i < n; ++i) {
    const Expr next = q[(i + 1) % n], here = q[i];
    f.push_back(sin(here - next) * Expr(i % 7 + 2) + here * here * next - exp(-here));
  }
  return f;
}

}  // namespace

TEST_CASE("symbols stand in the order of their declaration, known before or not") {
  const Expr known = symbol(Kind::parameter, "ordered_known");
  newly_declared({known});
  begin_declarations();
  const Expr made = symbol(Kind::parameter, "ordered_made");  // before the list is declared
  newly_declared({known, made});
  CHECK(declaration_of(known) < declaration_of(made));
  newly_declared({made, known});
  CHECK(declaration_of(known) < declaration_of(made));  // declaring again moves nothing
}

TEST_CASE("interning: structurally equal expressions are the same node") {
  CHECK(sin(x) * y == sin(x) * y);
  CHECK(x + y == y + x);  // commutative operands are ordered
  CHECK(x - y != y - x);
  CHECK(symbol(Kind::variable, "x") == x);
  CHECK(symbol(Kind::parameter, "x") != x);
  CHECK(derivative_leaf(derivative_leaf(x)) == derivative_leaf(x, 2));
  CHECK(Expr(0) == Expr());
  CHECK(Expr(-0.0) == Expr(0));
  CHECK(Expr(2) == Expr(2.0));
}

TEST_CASE("constants: a double is read as its simplest rational") {
  CHECK(exact_text(9.81) == "981/100");
  CHECK(exact_text(1.0 / 3) == "1/3");
  CHECK(exact_text(5.0 / 12) == "5/12");
  CHECK(exact_text(-0.1) == "-1/10");
  CHECK(exact_text(1e-7) == "1/10000000");  // decimals are exact as typed, at any exponent
  CHECK(exact_text(3e-9) == "3/1000000000");
  CHECK(exact_text(0.1 + 0.2) == "3/10");
  CHECK(exact_text(0.1 + 0.2 - 0.3) == "not exact");
  CHECK(exact_text(0.12345678901234) == "not exact");  // as many digits as computed numbers have
  CHECK(exact_text(0.25) == "1/4");
  CHECK(exact_text(std::ldexp(1.0, 60)) == "1152921504606846976");
  CHECK(exact_text(std::acos(-1.0)) == "not exact");
  CHECK(exact_text(std::sqrt(2.0)) == "not exact");
  CHECK(constant_value(Expr(1e-7)) == 1e-7);  // … and the double is kept to the last bit
  CHECK(constant_value(Expr(std::numeric_limits<double>::denorm_min())) ==
        std::numeric_limits<double>::denorm_min());
  CHECK(parse_number("1e-7") == Expr(mpq_class(1, 10000000)));
  CHECK(parse_number("-2/6") == Expr(mpq_class(-1, 3)));
  CHECK(parse_number("0.25") == parse_number("1/4"));
  for (const char* wrong : {"", "x", "1/0", "1//2", "1e", "--1", "0x10", "1e99999"})
    CHECK_THROWS_AS(parse_number(wrong), Error);
  CHECK_THROWS_AS(Expr(std::nan("")), Error);
  CHECK_THROWS_AS(Expr{std::numeric_limits<double>::infinity()}, Error);
}

TEST_CASE("constants: every double survives its way through the graph") {
  // CAUTION: the rational of a double is accepted only if it rounds to the very same double.
  for (int n = 1; n <= 200; ++n)
    for (int d = 1; d <= 200; ++d) {
      const double value = static_cast<double>(n) / d;
      CHECK(constant_value(Expr(value)) == value);
      REQUIRE(exact_value(Expr(value)) != nullptr);
      CHECK(mpq_class(*exact_value(Expr(value)) * d) == mpq_class(n));
    }
}

TEST_CASE("folding: neutral elements, signs, exact arithmetic") {
  CHECK(x + 0 == x);
  CHECK(x * 1 == x);
  CHECK((x * 0).is_zero());
  CHECK((x - x).is_zero());
  CHECK((x / x).is_one());
  CHECK(-(-x) == x);
  CHECK(x - (-y) == x + y);
  CHECK((-x) * (-y) == x * y);
  CHECK(x * x == pow(x, 2));
  CHECK(Expr(2) * (Expr(3) * x) == Expr(6) * x);
  CHECK(Expr(mpq_class(1, 3)) + Expr(mpq_class(1, 6)) == Expr(mpq_class(1, 2)));
  CHECK(sqrt(Expr(9)) == Expr(3));
  CHECK(sqrt(Expr(2)).op() == Op::sqrt);  // stays exact
  CHECK(pow(sqrt(Expr(2)), 2) == Expr(2));
  CHECK(sin(Expr(0)).is_zero());
  CHECK(ifelse(Expr(1), x, y) == x);
  CHECK_THROWS_WITH_AS(x / 0, "division by zero", Error);
  CHECK_THROWS_AS(Expr(1) / Expr(0), Error);
  CHECK_THROWS_AS(sqrt(Expr(-1)), Error);
  CHECK_THROWS_AS(log(Expr(0)), Error);
}

TEST_CASE("symbols: attributes, columns, leaves") {
  const auto q = symbol_vector(Kind::variable, "gq", 3);
  CHECK(symbol_of(q[1]).name == "gq2");
  CHECK(symbol_of(q[1]).component == 2);
  CHECK(vector_components("gq") == q);
  CHECK(symbol_of(derivative_leaf(q[2])).base == q[2]);
  const Expr e = sin(q[0]) * y + q[2];
  CHECK(leaves(std::span(&e, 1)).size() == 3);
  CHECK(depends_on(e, q[2]));
  CHECK_FALSE(depends_on(e, q[1]));
  CHECK_THROWS_AS(symbol(Kind::variable, "a b"), Error);
}

TEST_CASE("traversal is iterative: a chain of 200 000 operations is no recursion") {
  Expr e = x;
  for (int i = 0; i < 200'000; ++i) e = sin(e) + y;
  CHECK(topological({&e, 1}).size() == 400'002);
  CHECK_FALSE(partial(e, x).is_zero());
  CHECK(std::isfinite(evaluate({&e, 1}, {{x, 0.5}, {y, 0.25}})[0]));
}

TEST_CASE("scale: a graph of 10⁶ nodes, its sparse Jacobian and its kernel in seconds and linear time") {
  const auto time = [](int n, std::size_t& nodes) {
    const std::clock_t start = std::clock();
    const std::size_t before = graph_size();
    const auto f = chain(n);
    std::vector<Expr> q;
    for (int i = 0; i < n; ++i) q.push_back(symbol(Kind::variable, "chain" + std::to_string(i)));
    std::vector<Expr> outputs = f;
    const auto entries = sparse_jacobian(f, q);
    CHECK(entries.size() == 2 * static_cast<std::size_t>(n));
    for (const Entry& entry : entries) outputs.push_back(entry.value);
    const codegen::Kernel kernel(outputs, q);
    nodes = graph_size() - before;
    std::vector<double> in(static_cast<std::size_t>(n), 0.5), out(outputs.size());
    kernel(in.data(), out.data());
    CHECK(out[0] == doctest::Approx(0.125 - std::exp(-0.5)));
    return seconds_since(start);
  };
  std::size_t small_nodes = 0, nodes = 0;
  const double small = time(6'000, small_nodes);
  const double large = time(60'000, nodes);
  CAPTURE(small);
  CAPTURE(large);
  CHECK(nodes > 900'000);
  CHECK(large < 20);                   // 1–2 s in release; sanitizers are slower
  CHECK(large < 60 * (small + 0.01));  // 10 times the size: linear is 10, quadratic would be 100
}

TEST_CASE("memory: building and dropping the same model 10 000 times adds no node") {
  const auto model = [] {
    const auto f = chain(5);
    Expr energy = 0;
    for (Expr e : f) energy += e * e;
    for (const Entry& entry : sparse_jacobian(f, leaves(f))) energy += entry.value;
    return total_derivative(energy);
  };
  const Expr first = model();
  const std::size_t size = graph_size();
  for (int i = 0; i < 10'000; ++i) {
    if (model() != first) FAIL("the same model is another node");
  }
  CHECK(graph_size() == size);
}

}  // namespace pendula::graph_test
