// Random expressions over every operation: simplify and expand keep the value, simplify is idempotent,
// printing is deterministic, to_code rebuilds the same node. The seed is in the message of a failure.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "expr/normal/normal.hpp"
#include "expr/print/print.hpp"
#include "expr/print/vectors.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "random_expressions.hpp"

namespace pendula::random_test {

namespace {

/// Seeds of a campaign: as many as PENDULA_SEEDS says (`./dev simplify`), in CI the first few.
unsigned seeds(unsigned few) {
  const char* all = std::getenv("PENDULA_SEEDS");
  return all ? static_cast<unsigned>(std::stoul(all)) : few;
}

/// The measure of simplify: leaves, functions and signs of the collected form.
double length(Expr e) {
  NormalForms forms;
  return forms.traits(forms.form(e)).tokens;
}

/// Numbers have their normal forms whatever stands around them: √(1/2) is √2/2, log(9) is 2 log(3).
bool has_function_of_number(Expr e) {
  for (Expr node : topological({&e, 1})) {
    const bool root = node.op() == Op::sqrt || node.op() == Op::pow;
    const mpq_class* q = root || node.op() == Op::log ? exact_value(node.operand(0)) : nullptr;
    if (q && (!root || q->get_den() != 1)) return true;
  }
  return false;
}

/// (b x + b)³ becomes b³ (x + 1)³, which has one token more.
bool has_power_of_sum(Expr e) {
  const auto nodes = topological({&e, 1});
  return std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    return node.op() == Op::pow && (node.operand(0).op() == Op::add || node.operand(0).op() == Op::sub);
  });
}

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

Expr component(NormalForms& forms, const Lift& lift, std::size_t j) {
  Expr sum = 0;
  for (const LiftedTerm& t : lift)
    sum += forms.build(forms.intern(Sum{t.scalar})) * derivative_leaf(t.column.base[j], t.column.order);
  return sum;
}

/// What the items say, written out in components.
Expr meaning(NormalForms& forms, const std::vector<Item>& items) {
  Expr sum = 0;
  for (const Item& item : items) {
    Expr inside = item.vectors.empty() ? Expr(1) : Expr(0);
    if (!item.vectors.empty())
      for (std::size_t j = 0; j < static_cast<std::size_t>(item.vectors[0][0].column.size); ++j)
        inside += component(forms, item.vectors[0], j) * component(forms, item.vectors[1], j);
    sum += forms.build(forms.intern(Sum{item.term})) * inside;
  }
  return sum;
}

}  // namespace

TEST_CASE("random: scalar products that are recognised mean what was written") {
  const auto q = symbol_vector(Kind::variable, "rq", 6);
  const auto c = symbol_vector(Kind::parameter, "rc", 3);
  const std::vector<std::vector<Expr>> columns = {
      {q[0], q[1], q[2]}, {q[3], q[4], q[5]}, c, {q[1], q[2], q[3]}};
  const Columns known({false, {{"u", columns[0]}, {"v", columns[1]}, {"w", columns[3]}}});
  int recognised = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    CAPTURE(seed);
    RandomExpressions random(seed);
    Expr e = 0;
    for (int k = 0; k < 4; ++k) {  // whole and damaged scalar products of combinations
      const auto &a = columns[random.pick(4)], &b = columns[random.pick(4)], &d = columns[random.pick(4)];
      const Expr weight = random.expression(1);
      const int damage = random.pick(9);
      const bool difference = random.pick(2) == 0;
      for (int j = 0; j < 3; ++j) {
        const auto i = static_cast<std::size_t>(j);
        const Expr scale = damage == j ? Expr(2) : Expr(1);
        e += scale * weight * a[i] * (difference ? b[i] - d[i] : b[i]);
      }
    }
    NormalForms forms;
    const auto items = VectorFinder(forms, known).items(forms.form(e));
    for (const Item& item : items) recognised += !item.vectors.empty();
    const Expr back = meaning(forms, items);
    CAPTURE(to_text(e));
    CAPTURE(to_text(back));
    CHECK(expand(back - e).is_zero());
  }
  CHECK(recognised > 300);
}

TEST_CASE("random: simplify keeps the value, is idempotent and never lengthens") {
  for (unsigned seed = 1; seed <= seeds(600); ++seed) {
    CAPTURE(seed);
    RandomExpressions random(seed);
    const Expr e = random.expression(3 + static_cast<int>(seed % 4)), s = simplify(e);
    CAPTURE(to_text(e));
    CAPTURE(to_text(s));
    same_value(e, s, random);
    const auto value = steady_value(e, random.point());
    if (value && !has_function_of_number(e)) CHECK(length(s) <= length(e) + has_power_of_sum(e));
    const Expr again = simplify(s);
    CAPTURE(to_text(again));
    CHECK(again == s);
  }
}

TEST_CASE("random: expand keeps the value") {
  for (unsigned seed = 1; seed <= 400; ++seed) {
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

}  // namespace pendula::random_test
