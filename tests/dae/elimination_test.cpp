// Elimination of constant leading rows: the steps of exam 3(d), and systems where
// the answer is known by hand.
#include "dae/regularise/elimination.hpp"

#include <doctest/doctest.h>

#include "dae/index/array_conditions.hpp"
#include "dae/rank/tracked_elimination.hpp"
#include "dae/regularise/regularise.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "tests/dae/problems.hpp"

namespace pendula::elimination_test {

using namespace pendula::dae;
using namespace pendula::problems;

TEST_CASE(
    "exam 3(d): (3) - (1) - (2) gives 0 = x1 + x2 - x3, its derivative 0 = x1 - x2, then all is regular") {
  const auto m = exam_3d();
  CHECK_FALSE(analyse(*m).offsets.index() == 2);  // what structure alone says
  Equations e = equations_of(*m);
  std::vector<std::string> story;
  Structure s = structure_of(e);
  CHECK(s.rank.rank == 2);
  REQUIRE(eliminate_constant_rows(e, s, story) == Step::changed);
  const Expr x1 = unknown("x1"), x2 = unknown("x2"), x3 = unknown("x3");
  CHECK(generic::is_zero(e.residuals[2] - (x1 + x2 - x3)));
  REQUIRE(story.size() == 1);
  CHECK(story[0].find("(3) - (1) - (2):  0 = x₁ + x₂ - x₃") == 0);
  s = structure_of(e);
  CHECK_FALSE(s.regular);
  REQUIRE(eliminate_constant_rows(e, s, story) == Step::changed);
  s = structure_of(e);
  CHECK(s.regular);
  CHECK(s.offsets.value == 1);
  bool second = false;
  for (Expr r : e.residuals)
    second = second || generic::is_zero(r - (x1 - x2)) || generic::is_zero(r + (x1 - x2));
  CHECK(second);
}

TEST_CASE("exam 3(d) regularised: the model is equivalent, its analysis is valid: one degree of freedom") {
  const auto r = regularise(exam_3d());
  REQUIRE(r);
  CHECK(r->dof == 1);
  CHECK(r->differentiations == 2);
  CHECK(r->nonzero.empty());
  CHECK(r->definitions.empty());
  const Analysis a = analyse(*r->model);
  CHECK(a.regular);
  CHECK(a.dof == 1);
  CHECK(r->model->variables.size() == 3);
  CHECK(r->model->parent != nullptr);
}

TEST_CASE("second derivatives that cancel: x = t + sin t appears as an equation") {
  const auto r = regularise(hidden_sum());
  REQUIRE(r);
  CHECK(r->dof == 0);
  CHECK(r->differentiations == 3);
  CHECK(analyse(*r->model).regular);
}

TEST_CASE("rows with multipliers other than one, offsets that differ") {
  // 2 (1) + 3 (2): 0 = 5 x + y - …; then x′ enters with the derivative
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol();
  const auto m = model({{3 * derivative_leaf(x) + 6 * derivative_leaf(y) + x, 0},
                        {2 * derivative_leaf(x) + 4 * derivative_leaf(y) - y, t}});
  const auto r = regularise(m);
  REQUIRE(r);
  CHECK(r->dof == 1);
  CHECK(r->log[0].find("3 (2) - 2 (1)") == 0);
}

TEST_CASE("dependent and contradicting equations are reported, not regularised") {
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol();
  std::vector<std::string> why;
  CHECK_FALSE(regularise(model({{derivative_leaf(x) + y, 0}, {2 * derivative_leaf(x) + 2 * y, 0}}), &why));
  REQUIRE_FALSE(why.empty());
  CHECK(why.back().find("depend on each other") != std::string::npos);
  why.clear();
  CHECK_FALSE(regularise(model({{derivative_leaf(x) + y, 0}, {2 * derivative_leaf(x) + 2 * y, t}}), &why));
  CHECK(why.back().find("contains no unknown") != std::string::npos);
}

TEST_CASE("a derivative that cancels within one equation does not count") {
  const Expr x = unknown("x"), y = unknown("y"), d = derivative_leaf(x);
  const auto m = model({{(d + 1) * (d + 1) - d * d - 2 * d, 1 + x - y}, {derivative_leaf(y), x}});
  const auto r = regularise(m);
  REQUIRE(r);
  CHECK(r->dof == 1);  // x = y, y′ = x
  CHECK(r->log[0].find("which cancels") != std::string::npos);
}

TEST_CASE("a regular model is left alone") {
  std::vector<std::string> why;
  CHECK_FALSE(regularise(pendulum(), &why));
  CHECK(why.empty());
  CHECK_FALSE(regularise(cstr()));
}

TEST_CASE("tracked elimination: combinations reproduce the rows") {
  TrackedElimination elimination;
  const auto row = [](std::initializer_list<int> values, int name) {
    TrackedRow r;
    int j = 0;
    for (int v : values) {
      if (v) r.entries[j] = v;
      ++j;
    }
    r.combination[name] = 1;
    return r;
  };
  CHECK_FALSE(elimination.add(row({1, 2, 3}, 0)).entries.empty());
  CHECK_FALSE(elimination.add(row({0, 1, 1}, 1)).entries.empty());
  TrackedRow left = elimination.add(row({2, 5, 7}, 2));  // = 2·(row 0) + (row 1)
  CHECK(left.entries.empty());
  make_coprime(left.combination);
  CHECK(left.combination.at(0) == -2);
  CHECK(left.combination.at(1) == -1);
  CHECK(left.combination.at(2) == 1);
  CHECK(combination_text(left.combination, [](int i) { return "r" + std::to_string(i); }) ==
        "r2 - 2 r0 - r1");
}

}  // namespace pendula::elimination_test
