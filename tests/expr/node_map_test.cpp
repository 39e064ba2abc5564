// Values beside nodes: what a pass costs depends on the nodes it touches, not on the size of the session.
#include <doctest/doctest.h>

#include <vector>

#include "expr/graph/node_map.hpp"

namespace pendula::node_map_test {

namespace {

/// Counts the values that exist.
struct Counted {
  static inline int alive = 0;
  int value = 7;
  Counted() { ++alive; }
  Counted(const Counted& other) : value(other.value) { ++alive; }
  Counted& operator=(const Counted&) = default;
  ~Counted() { --alive; }
};

constexpr int page = 256, many = 400 * page;

/// A node behind `many` others.
Expr last_node() {
  static const Expr last = [] {
    Expr e = symbol(Kind::variable, "node_map");
    while (e.id() < many || e.id() % (page / 2) == 1) e = sin(e + Expr(1));
    return e;
  }();
  return last;
}

}  // namespace

TEST_CASE("node map: a value is new in every round, and stays where it is within one") {
  const Expr last = last_node();
  NodeMap<Counted> map;
  Counted& first = map[Expr(0)];
  first.value = 1;
  for (std::uint32_t id = 0; id < last.id(); id += page / 2) map[Expr::at(id + 1)].value = 2;
  CHECK(&map[Expr(0)] == &first);
  CHECK(map[Expr(0)].value == 1);
  CHECK(map.has(Expr(0)));
  CHECK_FALSE(map.has(last));
  map.clear();
  CHECK_FALSE(map.has(Expr(0)));
  CHECK(map[Expr(0)].value == 7);
}

TEST_CASE("node map: few nodes of a large graph hold few values, also after a pass over all of it") {
  const Expr last = last_node();
  const int before = Counted::alive;
  NodeMap<Counted> map;
  const auto held = [&] { return Counted::alive - before; };
  map[Expr(0)];
  map[last];
  CHECK(held() == 2 * page);
  for (std::uint32_t id = 0; id <= last.id(); id += page) map[Expr::at(id)];
  CHECK(held() >= many);
  for (int round = 0; round < 70; ++round) {
    map.clear();
    map[Expr(0)].value = round;
    map[last];
  }
  CHECK(held() == 2 * page);
  CHECK(map[Expr(0)].value == 69);
}

}  // namespace pendula::node_map_test
