// The derivative array against problems whose index, degrees of freedom and conditions are known from the
// literature or by hand.
#include "dae/index/array_index.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "base/error.hpp"
#include "dae/analysis/analysis.hpp"
#include "dae/model/make_model.hpp"
#include "dae/points/array_points.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "tests/dae/problems.hpp"

namespace pendula::derivative_array_test {

using namespace pendula::dae;
using namespace pendula::problems;

namespace {

void check_truth(const ModelPtr& m, int index, int dof) {
  const ArrayResult r = derivative_array(*m);
  CAPTURE(r.text);
  CAPTURE(r.covered);
  CHECK(r.verdict == ArrayVerdict::determined);
  CHECK(r.index == index);
  CHECK(r.dof == dof);
}

bool contains(const std::vector<ArrayCondition>& list, Expr e) {
  for (const auto& c : list)
    if (generic::is_zero(c.residual - e) || generic::is_zero(c.residual + e)) return true;
  return false;
}

}  // namespace

TEST_CASE("exam 3(d): index 2, one degree of freedom, 0 = x1 + x2 - x3 and 0 = x1 - x2") {
  const ArrayResult r = derivative_array(*exam_3d());
  CHECK(r.exact);
  CHECK(r.index == 2);
  CHECK(r.dof == 1);
  const Expr x1 = unknown("x1"), x2 = unknown("x2"), x3 = unknown("x3");
  REQUIRE(r.constraints.size() == 2);
  CHECK(generic::is_zero(r.constraints[0].residual - (x1 + x2 - x3)));
  CHECK(generic::is_zero(r.constraints[1].residual - (x1 - x2)));
  CHECK(r.constraints[0].derivative == 0);
  CHECK(r.constraints[1].derivative == 1);
  CHECK(r.constraints[0].from == "(3) - (1) - (2)");
}

TEST_CASE("nilpotent E of the lecture: index 3, nothing is free, x = (-u″, -u′, -u)") {
  const ArrayResult r = derivative_array(*nilpotent());
  CHECK(r.index == 3);
  CHECK(r.dof == 0);
  const Expr u = known("u");
  CHECK(contains(r.constraints, unknown("x3") + u));
  CHECK(contains(r.constraints, unknown("x2") + derivative_leaf(u)));
  CHECK(contains(r.constraints, unknown("x1") + derivative_leaf(u, 2)));
}

TEST_CASE("CSTR of the lecture: index 2, three free initial values") { check_truth(cstr(), 2, 3); }

TEST_CASE("a structural index above the true one: structural 3, true 1, two degrees of freedom") {
  const ModelPtr m = reissig();
  CHECK(analyse(*m).offsets.index() == 3);
  const ArrayResult r = derivative_array(*m);
  CHECK(r.index == 1);
  CHECK(r.dof == 2);
  CHECK(r.constraints.size() == 3);
}

TEST_CASE("two equations of second order that hide x = t + sin t: index 3, nothing is free") {
  const ArrayResult r = derivative_array(*hidden_sum());
  CHECK(r.index == 3);
  CHECK(r.dof == 0);
  const Expr x = unknown("x"), t = time_symbol();
  CHECK(contains(r.constraints, x - t - sin(t)));
  CHECK(contains(r.constraints, unknown("y")));
}

TEST_CASE("planar pendulum: index 3, two degrees of freedom, at points on the circle") {
  const ArrayResult r = derivative_array(*pendulum());
  CHECK_FALSE(r.exact);
  CHECK(r.points == 3);
  CHECK(r.gap > 1e4);
  CHECK(r.index == 3);
  CHECK(r.dof == 2);
  CHECK(r.conditions == 3);
}

TEST_CASE("transistor amplifier: index 1, five of eight free, three conditions written out") {
  const ArrayResult r = derivative_array(*transistor_amplifier());
  CAPTURE(r.text);
  CAPTURE(r.covered);
  CHECK(r.index == 1);
  CHECK(r.dof == 5);
  CHECK(r.conditions == 3);
  CHECK(r.constraints.size() == 3);
  for (const auto& c : r.constraints) CHECK(c.derivative == 0);
}

TEST_CASE("an index that depends on a parameter: told for the given value, and what is generic") {
  // x′ = -z, 0 = x + ε z: index 1, at ε = 0 index 2
  const Expr x = unknown("x"), z = unknown("z"), epsilon = parameter("epsilon");
  const ModelPtr m = model({{derivative_leaf(x), -z}, {0, x + epsilon * z}});
  CHECK(derivative_array(*m).index == 1);
  const ArrayResult zero = derivative_array(*with_values(m, {{epsilon, 0}}));
  CHECK(zero.index == 2);
  CHECK(zero.dof == 0);
  REQUIRE(zero.generic_index);
  CHECK(*zero.generic_index == 1);
  CHECK(zero.text.find("almost all other parameter values the index is 1") != std::string::npos);
  const ArrayResult one = derivative_array(*with_values(m, {{epsilon, 1}}));
  CHECK(one.index == 1);
  CHECK_FALSE(one.generic_index);
}

TEST_CASE("z³ = y: index 1 where z ≠ 0, singular at z = 0, and 0 = z³ has no index by ranks") {
  const Expr y = unknown("y"), z = unknown("z");
  const ModelPtr m = model({{derivative_leaf(y), 1}, {0, z * z * z - y}});
  check_truth(m, 1, 1);
  std::unordered_map<Expr, double> origin{{y, 0}, {z, 0}, {time_symbol(), 0}};
  ArrayOptions options;
  options.at = &origin;
  const ArrayResult there = derivative_array(*m, options);
  CHECK(there.verdict == ArrayVerdict::singular);
  CHECK(there.text.find("singular at this point") != std::string::npos);
  origin = {{y, 8}, {z, 2}, {time_symbol(), 0}};
  CHECK(derivative_array(*m, options).verdict == ArrayVerdict::determined);
  const ModelPtr cube = model({{derivative_leaf(y), z}, {0, z * z * z}});
  CHECK(derivative_array(*cube).verdict == ArrayVerdict::singular);
}

TEST_CASE("models without an index are told apart from those that have one") {
  const Expr x = unknown("x"), y = unknown("y");
  const ArrayResult twice =
      derivative_array(*model({{derivative_leaf(x), y}, {0, 2 * derivative_leaf(x) - 2 * y}}));
  CHECK(twice.verdict == ArrayVerdict::undetermined);
  CHECK(!twice.index);
  CHECK(twice.text.find("no unique solution") != std::string::npos);
  check_truth(model({{derivative_leaf(x), -x * y}, {derivative_leaf(y), x}}), 0, 2);
}

TEST_CASE("points where branches meet do not count: 0 = z (z - x - 2) is index 1 on both of them") {
  const Expr x = unknown("x"), z = unknown("z");
  check_truth(model({{derivative_leaf(x), 1 - z}, {0, z * (z - x - 2)}}), 1, 1);
}

TEST_CASE("unspecified functions: x′ = f(x, z), 0 = g(x) has index 2") {
  const Expr x = unknown("x"), z = unknown("z");
  const auto f = [&](const char* name, std::vector<Expr> args) {
    FunctionCall c;
    c.name = name;
    c.groups.assign(args.size(), 1);
    c.partial.assign(args.size(), 0);
    c.arguments = args;
    return call(c);
  };
  check_truth(model({{derivative_leaf(x), f("f_any", {x, z})}, {0, f("g_any", {x})}}), 2, 0);
  check_truth(model({{derivative_leaf(x), f("f_any", {x, z})}, {0, f("g_two", {x, z})}}), 1, 1);
}

TEST_CASE("what is too large is said to be not covered") {
  const Expr x = unknown("x"), y = unknown("y");
  ArrayOptions options;
  options.max_columns = 4;
  const ArrayResult r =
      derivative_array(*model({{derivative_leaf(x), -x * y}, {0, x * x + y * y * y - 1}}), options);
  CHECK(r.verdict == ArrayVerdict::not_covered);
  CHECK(!r.index);
  CHECK(r.text.find("columns") != std::string::npos);
}

TEST_CASE("rank with gap: units do not matter, noise is not counted") {
  Mat m(3, 3);
  m << 1e6, 2e-6, 0, 3e6, 1e-6, 0, 1e6, 2e-6, 1e-18;
  CHECK(rank_with_gap(m).rank == 3);  // a small entry alone in its column is a unit, not noise
  m(2, 2) = 0;
  CHECK(rank_with_gap(m).rank == 2);
  m << 1, 2, 3, 4, 5, 6, 5, 7, 9 + 1e-14;
  CHECK(rank_with_gap(m).rank == 2);
}

TEST_CASE("rank in any units: a triangular matrix in units that fall from column to column is regular") {
  for (const double factor : {1.0, 1 / 6.6, 6.6, 1e-4}) {
    const int n = 16;
    Mat m = Mat::Zero(n, n);
    for (int k = 0; k + 1 < n; ++k) {
      m(k, k) = std::pow(factor, k);
      m(k, k + 1) = -std::pow(factor, k + 1);
    }
    m(n - 1, 0) = 1.5;
    CHECK(rank_in_any_units(m).rank == n);
    CHECK(rank_in_any_units(m).gap > clear_gap);
    m.row(n - 1) = m.row(3) - 2 * m.row(7);
    CHECK(rank_in_any_units(m).rank == n - 1);
  }
}

}  // namespace pendula::derivative_array_test
