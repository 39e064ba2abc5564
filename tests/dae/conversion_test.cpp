// Conversions with functions as multipliers: what replaces what, where it is valid,
// and that the solutions stay.
#include "dae/regularise/regularise.hpp"

#include <doctest/doctest.h>

#include "dae/index/array_index.hpp"
#include "dae/model/make_model.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "tests/dae/problems.hpp"

namespace pendula::conversion_test {

using namespace pendula::dae;
using namespace pendula::problems;

namespace {

std::string story_of(const Regularised& r) {
  std::string all;
  for (const auto& line : r.log) all += line + "\n";
  return all;
}

/// The regularised model and the derivative array of the original agree.
void check_both_roads(const ModelPtr& m, int index, int dof) {
  const ArrayResult truth = derivative_array(*m);
  CAPTURE(truth.text);
  CHECK(truth.index == index);
  CHECK(truth.dof == dof);
  const auto r = regularise(m);
  REQUIRE(r);
  CAPTURE(story_of(*r));
  CHECK(r->dof == dof);
  CHECK(r->differentiations >= index);
  const Analysis a = analyse(*r->model);
  CHECK(a.regular);
  CHECK(a.dof == dof);
}

}  // namespace

TEST_CASE("linear combination with a function: (2) - x (1), valid everywhere") {
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol(), dx = derivative_leaf(x),
             dy = derivative_leaf(y);
  const auto m = model({{dx + x * dy, 1}, {x * dx + x * x * dy, y - sin(t)}});
  CHECK_FALSE(analyse(*m).regular);
  const auto r = regularise(m);
  REQUIRE(r);
  CAPTURE(story_of(*r));
  CHECK(r->nonzero.empty());
  CHECK(r->definitions.empty());
  CHECK(r->log[0] == "(2) - x (1):  0 = x - y + sin(t)   replaces (2) as (2*), valid everywhere");
  CHECK(r->dof == 1);
  bool found = false;  // x - y + sin t = 0
  for (Expr e : r->model->residuals)
    found = found || generic::is_zero(e - (x - y + sin(t))) || generic::is_zero(e + (x - y + sin(t)));
  CHECK(found);
  CHECK(story_of(*r).find("valid everywhere") != std::string::npos);
  check_both_roads(m, 1, 1);
}

TEST_CASE("linear combination where a coefficient must not vanish: the domain is named") {
  const Expr x = unknown("x"), y = unknown("y"), z = unknown("z"), dx = derivative_leaf(x),
             dy = derivative_leaf(y);
  // both rows are multiplied with unknowns: one of them has to be divided by
  const auto m = model({{y * (dx + dy), z}, {x * (dx + dy), 1}, {derivative_leaf(z), x}});
  const auto r = regularise(m);
  REQUIRE(r);
  CAPTURE(story_of(*r));
  REQUIRE(r->nonzero.size() == 1);
  CHECK(story_of(*r).find("valid where " + to_text(r->nonzero[0]) + " ≠ 0") != std::string::npos);
  check_both_roads(m, 1, 2);
}

TEST_CASE("a new unknown for the shared combination w = x′ - y′ where combinations are not allowed") {
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol(),
             shared = derivative_leaf(x) - derivative_leaf(y);
  const auto m = model({{exp(shared) + x, 3}, {sin(shared) + y, t}});
  const auto r = regularise(m);
  REQUIRE(r);
  CAPTURE(story_of(*r));
  REQUIRE(r->definitions.size() == 1);
  const auto [w, meaning] = *r->definitions.begin();
  CHECK((generic::is_zero(meaning - shared) || generic::is_zero(meaning + shared)));
  CHECK(r->model->variables.size() == 3);
  CHECK(r->nonzero.empty());
  CHECK(story_of(*r).find("new unknown:  " + to_text(w) + " = ") != std::string::npos);
  check_both_roads(m, 1, 1);
}

TEST_CASE("a parameter as coefficient: valid where it is not zero") {
  const Expr x = unknown("x"), y = unknown("y"), m1 = parameter("m1"), m2 = parameter("m2");
  const Expr dx = derivative_leaf(x), dy = derivative_leaf(y);
  const auto m = model({{m1 * dx + m1 * dy, x}, {m2 * dx + m2 * dy, y}});
  check_both_roads(m, 1, 1);
  const auto r = regularise(m);
  for (Expr e : r->nonzero)
    for (Expr leaf : leaves({&e, 1})) CHECK(symbol_of(leaf).kind == pendula::Kind::parameter);
}

TEST_CASE("singular only at the given parameter values: regularised with them, and it says so") {
  const Expr x = unknown("x"), y = unknown("y"), k = parameter("k");
  const Expr dx = derivative_leaf(x), dy = derivative_leaf(y);
  const auto m = model({{dx + dy, x}, {dx + k * dy, y}});
  CHECK_FALSE(regularise(m));  // generic k: an ODE
  CHECK_FALSE(regularise(with_values(m, {{k, 2}})));
  const auto one = with_values(m, {{k, 1}});
  const auto r = regularise(one);
  REQUIRE(r);
  CHECK(r->log[0] == "with the parameter values k = 1");
  CHECK(r->dof == 1);
  const ArrayResult truth = derivative_array(*one);
  CHECK(truth.index == 1);
  CHECK(truth.generic_index == 0);
}

TEST_CASE("a pendulum whose constraint is hidden in an equation of motion") {
  const Expr x = unknown("x"), y = unknown("y"), z = unknown("z"), g(9.81), ax = derivative_leaf(x, 2),
             ay = derivative_leaf(y, 2);
  // (3) = (x² + y² - 1) + x (1) + y (2): the same solutions, but no row shows the constraint
  const Expr e1 = ax + z * x, e2 = ay + z * y + g;
  const auto m = model({{e1, 0}, {e2, 0}, {x * x + y * y - 1 + x * e1 + y * e2, 0}});
  CHECK_FALSE(analyse(*m).regular);
  check_both_roads(m, 3, 2);
}

TEST_CASE("structurally singular models are not regularised") {
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol();
  std::vector<std::string> why;
  CHECK_FALSE(regularise(
      model({{x, t}, {x * x + derivative_leaf(x), 1}, {derivative_leaf(y) + unknown("z"), x}}), &why));
  REQUIRE(why.size() == 1);
  CHECK(why[0].find("structurally singular") != std::string::npos);
}

TEST_CASE("the row of a column equation is replaced in place and noted") {
  const Expr x1 = unknown("x1"), x2 = unknown("x2"), x3 = unknown("x3");
  Block b;
  b.lhs.resize(3), b.rhs.resize(3);
  b.lhs << derivative_leaf(x1) + derivative_leaf(x2), derivative_leaf(x3),
      derivative_leaf(x1) + derivative_leaf(x2) + derivative_leaf(x3);
  b.rhs << x1, x2, x3;
  const auto r = regularise(make_model({b}));
  REQUIRE(r);
  REQUIRE(r->blocks.size() == 1);
  REQUIRE(r->blocks[0].rewritten.size() == 3);
  CHECK(r->blocks[0].rewritten[2] == "(1c) - (1a) - (1b)");
  CHECK(r->blocks[0].rewritten[0] == "");
  CHECK(r->model->label(0) == "(1a)");
  CHECK(r->model->label(2) == "(1c*)");  // another equation than the one that was written has another number
}

TEST_CASE("a Jacobian that contains the equations: regular in general, singular where they hold") {
  // e = x′ + y - t; in 0 = x - t + z e the coefficient of z is e itself, which is 0
  const Expr x = unknown("x"), y = unknown("y"), z = unknown("z"), t = time_symbol();
  const Expr e = derivative_leaf(x) + y - t;
  const auto m = model({{e, 0}, {x - t + z * e, 0}, {derivative_leaf(z), x}});
  const ArrayResult truth = derivative_array(*m);
  CAPTURE(truth.text);
  CHECK(truth.verdict == ArrayVerdict::determined);
  CHECK(truth.index == 2);  // x = t, and y = t - x′ needs x″ for y′
  CHECK(truth.dof == 1);
}

TEST_CASE("a structure that is right in general and wrong on the solutions is not called regular") {
  // x′ = z, 0 = y + z e, e = x - t: on solutions ∂/∂z of the second vanishes
  const Expr x = unknown("x"), y = unknown("y"), z = unknown("z"), t = time_symbol();
  const auto m = model({{derivative_leaf(y), z}, {x - t, 0}, {y - sin(t) + z * (x - t), 0}});
  const Structure s = structure_of(equations_of(*m));
  CHECK(s.rank.rank == 3);
  CHECK(s.singular_on_solutions);
  CHECK_FALSE(s.regular);
  std::vector<std::string> why;
  CHECK_FALSE(regularise(m, &why));
  CHECK(why.back().find("singular wherever the equations hold") != std::string::npos);
  const ArrayResult truth = derivative_array(*m);
  CAPTURE(truth.text);
  CHECK(truth.index == 2);
  CHECK(truth.dof == 0);
}

}  // namespace pendula::conversion_test
