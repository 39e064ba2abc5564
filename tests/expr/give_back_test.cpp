// Expressions that nobody refers to any more are given back, and those that somebody refers to are not.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/lru_cache.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/graph.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::give_back_test {

namespace {

const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y"), k = symbol(Kind::parameter, "k"),
           number_pi = pi();  // symbols stay: none is made later

Expr product(int i) { return sin(x * Expr(i)) * exp(y + Expr(i)) + Expr(mpq_class(i, 7919)); }

VecX solved_pair(Expr a, Expr b) {
  MatX A(2, 2);
  A << x + a, y, y, x - a;
  VecX right(2);
  right << b, x;
  return linear_solution(A, right);
}

double value(Expr e) { return evaluate({&e, 1}, {{x, 0.5}, {y, 0.25}, {k, 3}})[0]; }

/// Gives back what is touched neither by `known` nor in these windows, nor in window 0, where other files of
/// this program made their expressions.
std::uint32_t in_use_after(const std::vector<Expr>& known, std::vector<std::uint16_t> windows = {}) {
  windows.insert(windows.begin(), 0);
  give_back(windows, [&] {
    for (Expr e : known) touch(e);
  });
  return expressions_in_use();
}

}  // namespace

TEST_CASE("what is known stays with its operands, the rest goes, and can be made again") {
  const std::uint32_t begin = in_use_after({});
  const Expr kept = product(30);
  const std::string text_of_kept = to_text(kept);
  for (int i = 2; i < 50; ++i) product(i);
  REQUIRE(expressions_in_use() > begin + 200);
  const std::uint32_t with_one = in_use_after({kept});
  CHECK(with_one < begin + 20);
  CHECK(to_text(kept) == text_of_kept);
  CHECK(kept == product(30));
  CHECK(expressions_in_use() <= with_one + 3);  // what is folded on the way to an expression
  for (int i = 49; i >= 2; --i) {
    const Expr e = product(i);
    CHECK(e == product(i));
    CHECK(value(e) == doctest::Approx(std::sin(0.5 * i) * std::exp(0.25 + i) + i / 7919.0).epsilon(1e-14));
  }
  CHECK(in_use_after({}) == begin);
}

TEST_CASE("what was made or asked for in the window of a living object stays") {
  in_use_after({});
  const Expr early = product(60);
  const std::uint16_t first = expression_window();
  const std::uint32_t with_early = in_use_after({}, {first});
  CHECK(early == product(60));  // asked for in the second window, too
  const std::uint16_t second = expression_window();
  const Expr late = product(61) * early;
  CHECK(in_use_after({}, {first}) == with_early);
  CHECK(product(60) == early);
  CHECK(product(61) * early != late);  // given back: ids are not used again
  CHECK(in_use_after({}, {second}) >= with_early);
  CHECK(product(60) == early);
}

TEST_CASE("what was remembered of expressions that went is forgotten") {
  const std::uint32_t begin = in_use_after({});
  for (int i = 2; i < 30; ++i) {
    const Expr e = sin(x * Expr(i)) * Expr(i + 40) + Expr(mpq_class(1, i + 100));
    CHECK(value(partial(e, x)) == doctest::Approx(i * (i + 40) * std::cos(0.5 * i)).epsilon(1e-14));
    CHECK(value(simplify(e + e)) == doctest::Approx(2 * value(e)).epsilon(1e-14));
    CHECK(in_use_after({}) == begin);
  }
}

TEST_CASE("systems of linear equations go with their nodes, and stay with one of them") {
  const std::uint32_t begin = in_use_after({});
  for (int i = 1; i < 10; ++i) {
    const double a = i, b = 2 * i, det = (0.5 + a) * (0.5 - a) - 0.0625;
    const VecX solved = solved_pair(Expr(i), Expr(2 * i));
    in_use_after({solved[1]});
    CHECK(value(solved[1]) == doctest::Approx(((0.5 + a) * 0.5 - 0.25 * b) / det).epsilon(1e-13));
    CHECK(solved[1] == solved_pair(Expr(i), Expr(2 * i))[1]);
    CHECK(in_use_after({}) == begin);
    CHECK(value(solved_pair(Expr(i), Expr(2 * i))[0]) ==
          doctest::Approx((b * (0.5 - a) - 0.25 * 0.5) / det).epsilon(1e-13));
    CHECK(in_use_after({}) == begin);
  }
}

TEST_CASE("unspecified functions, and values of parameters") {
  const std::uint32_t begin = in_use_after({});
  for (int i = 1; i < 10; ++i) {
    const FunctionCall g{"g", {1}, {0}, {x * Expr(i + 60)}};
    const Expr applied = call(g);
    attributes(k).value = sqrt(Expr(mpq_class(i, 7907)));
    in_use_after({applied});
    CHECK(call_of(applied).arguments[0] == x * Expr(i + 60));
    CHECK(applied == call(g));
    CHECK(value(*attributes(k).value) == doctest::Approx(std::sqrt(i / 7907.0)).epsilon(1e-14));
    CHECK(*attributes(k).value == sqrt(Expr(mpq_class(i, 7907))));
  }
  attributes(k).value.reset();
  CHECK(in_use_after({}) == begin);
}

TEST_CASE("a cache inside a cache is forgotten with it") {
  LruCache<int, std::shared_ptr<LruCache<int, int>>> outer(10);
  for (int i = 0; i < 5; ++i) outer.insert(i, std::make_shared<LruCache<int, int>>(10))->insert(1, i);
  const auto kept = *outer.find(3);
  Remembered::forget_all();
  CHECK(outer.size() == 0);
  CHECK(kept->size() == 0);
}

TEST_CASE("who reads what is remembered refers to the windows in which it was made") {
  LruCache<int, int> cache(10);
  Origins::begin(3);
  Origins::add(std::make_shared<std::vector<std::uint16_t>>(1, std::uint16_t{1}));
  cache.insert(7, 49);
  Origins::begin(5);
  CHECK(*Origins::so_far() == std::vector<std::uint16_t>{5});
  CHECK(*cache.find(7) == 49);
  CHECK(*Origins::so_far() == std::vector<std::uint16_t>{1, 3, 5});
  Origins::begin(expression_window());
}

}  // namespace pendula::give_back_test
