// Offsets on integer patterns: facts that can be checked by hand (Pryce 2001, §2 and §6).
#include <doctest/doctest.h>

#include <random>

#include "dae/structure/sigma.hpp"
#include "dae/structure/variable_levels.hpp"

namespace pendula::sigma_test {

using namespace pendula::dae;

TEST_CASE("the planar pendulum has c = (0, 0, 2), d = (2, 2, 0), index 3, two degrees of freedom") {
  // x″ + λx = 0, y″ + λy + g = 0, x² + y² = L²; variables x, y, λ
  const Offsets o = offsets({{{0, 2}, {2, 0}}, {{1, 2}, {2, 0}}, {{0, 0}, {1, 0}}}, 3);
  CHECK(o.c == std::vector<int>{0, 0, 2});
  CHECK(o.d == std::vector<int>{2, 2, 0});
  CHECK(o.index() == 3);
  CHECK(o.value == 2);
}

TEST_CASE(
    "an unknown that follows from others by their values alone is of index 1, beside a multiplier of index 3") {
  // p′ = v, v′ = -λ, p = u, z = p, w = v, a = v′: of index 1, 2, 3, 1, 2, 3
  const Signature sigma = {{{0, 1}, {1, 0}}, {{1, 1}, {2, 0}}, {{0, 0}},
                           {{0, 0}, {3, 0}}, {{1, 0}, {4, 0}}, {{1, 1}, {5, 0}}};
  const Offsets o = offsets(sigma, 6);
  const std::vector<int> levels = variable_levels(sigma, o);
  std::vector<int> index;
  for (std::size_t j = 0; j < levels.size(); ++j) index.push_back(1 + levels[j] - o.d[j]);
  CHECK(index == std::vector<int>{1, 2, 3, 1, 2, 3});
}

TEST_CASE("a chain of integrators with the last state prescribed: c counts down") {
  // x1′ = x2, x2′ = x3, x1 = u: nilpotent of index 3
  const Offsets o = offsets({{{0, 1}, {1, 0}}, {{1, 1}, {2, 0}}, {{0, 0}}}, 3);
  CHECK(o.c == std::vector<int>{1, 0, 2});
  CHECK(o.d == std::vector<int>{2, 1, 0});
  CHECK(o.index() == 3);
  CHECK(o.value == 0);
}

TEST_CASE("an explicit ODE is index 0, a semi-explicit model with regular ∂g/∂z index 1") {
  CHECK(offsets({{{0, 1}}, {{0, 0}, {1, 1}}}, 2).index() == 0);
  CHECK(offsets({{{0, 1}, {1, 0}}, {{0, 0}, {1, 0}}}, 2).index() == 1);
}

TEST_CASE("an equation that cannot be matched is reported") {
  const Offsets o = offsets({{{0, 1}}, {{0, 0}}, {{1, 1}, {2, 1}}}, 3);
  REQUIRE(o.unmatched.size() == 1);
  CHECK(o.unmatched[0] == 1);
}

TEST_CASE("random patterns: the offsets are a dual solution and the transversal attains it") {
  std::mt19937 random(20261121);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + static_cast<int>(random() % 8);
    Signature sigma(n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (i == j || random() % 3 == 0) sigma[i].push_back({j, static_cast<int>(random() % 4)});
    const Offsets o = offsets(sigma, n);
    CAPTURE(trial);
    REQUIRE(o.unmatched.empty());  // the diagonal is a transversal
    int transversal = 0;
    for (int i = 0; i < n; ++i) {
      CHECK(o.c[i] >= 0);
      for (const auto& e : sigma[i]) {
        CHECK(o.d[e.variable] - o.c[i] >= e.order);
        if (o.equation_of[e.variable] == i) transversal += e.order;
      }
    }
    CHECK(transversal == o.value);  // equal values: both are optimal (linear programming duality)
  }
}

}  // namespace pendula::sigma_test
