// Dulmage–Mendelsohn on small patterns by hand and on random ones by their defining properties.
#include <doctest/doctest.h>

#include <ctime>
#include <random>
#include <set>

#include "dae/structure/blocks.hpp"

namespace pendula::blocks_test {

using namespace pendula::dae;

TEST_CASE("over- and under-determined parts are named") {
  // rows 0, 1 only know column 0; row 2 alone has columns 1 and 2; row 3 and column 3 match
  const Blocks b = dulmage_mendelsohn({{0}, {0}, {1, 2}, {3}}, 4);
  CHECK(b.over.rows == std::vector<int>{0, 1});
  CHECK(b.over.columns == std::vector<int>{0});
  CHECK(b.under.rows == std::vector<int>{2});
  CHECK(b.under.columns == std::vector<int>{1, 2});
  REQUIRE(b.square.size() == 1);
  CHECK(b.square[0].rows == std::vector<int>{3});
}

TEST_CASE("a lower triangular pattern with one loop: blocks in order of solution") {
  const Blocks b = dulmage_mendelsohn({{0}, {0, 1, 2}, {1, 2}, {2, 3}}, 4);
  REQUIRE(b.square.size() == 3);
  CHECK(b.square[0].columns == std::vector<int>{0});
  CHECK(b.square[1].columns == std::vector<int>{1, 2});
  CHECK(b.square[2].columns == std::vector<int>{3});
}

TEST_CASE("random patterns: the parts cover everything once and are block triangular") {
  std::mt19937 random(7);
  for (int trial = 0; trial < 500; ++trial) {
    const int rows = 1 + static_cast<int>(random() % 9), columns = 1 + static_cast<int>(random() % 9);
    Pattern p(rows);
    for (auto& row : p)
      for (int j = 0; j < columns; ++j)
        if (random() % 4 == 0) row.push_back(j);
    const Blocks b = dulmage_mendelsohn(p, columns);
    CAPTURE(trial);
    std::multiset<int> covered_rows(b.over.rows.begin(), b.over.rows.end()),
        covered_columns(b.over.columns.begin(), b.over.columns.end());
    covered_rows.insert(b.under.rows.begin(), b.under.rows.end());
    covered_columns.insert(b.under.columns.begin(), b.under.columns.end());
    std::set<int> known(b.over.columns.begin(),
                        b.over.columns.end());  // square rows may use columns of the over-determined part
    for (const Part& part : b.square) {
      CHECK(part.rows.size() == part.columns.size());
      known.insert(part.columns.begin(), part.columns.end());
      for (int i : part.rows)
        for (int j : p[i]) CHECK(known.count(j) == 1);  // only itself and what came before
      covered_rows.insert(part.rows.begin(), part.rows.end());
      covered_columns.insert(part.columns.begin(), part.columns.end());
    }
    CHECK(static_cast<int>(covered_rows.size()) == rows);
    CHECK(static_cast<int>(covered_columns.size()) == columns);
    if (!b.over.rows.empty()) CHECK(b.over.rows.size() > b.over.columns.size());
    if (!b.under.columns.empty()) CHECK(b.under.columns.size() > b.under.rows.size());
  }
}

TEST_CASE("3·10⁵ groups that each lean on the one before: dead ends are not walked again for every group") {
  constexpr int groups = 300'000;
  Pattern p;
  for (int g = 0; g < groups; ++g) {
    p.push_back({2 * g, 2 * g + 1});                                  // takes column 2g first
    p.push_back(g ? std::vector{2 * g - 2, 2 * g} : std::vector{0});  // and has to give it up
  }
  const auto before = std::clock();
  CHECK(dulmage_mendelsohn(p, 2 * groups).square.size() == 2 * groups);
  CHECK(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC < 30);  // 0.2 s; group by group minutes
}

}  // namespace pendula::blocks_test
