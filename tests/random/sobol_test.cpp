// Sobol' numbers against the table of Joe & Kuo; what scrambling must keep.
#include "random/sobol.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace pendula::sobol_test {

using namespace pendula::random;

TEST_CASE("points of the sequence as published") {
  // The first ten points of the program of Joe & Kuo in three dimensions.
  const double expected[10][3] = {{0, 0, 0},
                                  {.5, .5, .5},
                                  {.75, .25, .25},
                                  {.25, .75, .75},
                                  {.375, .375, .625},
                                  {.875, .875, .125},
                                  {.625, .125, .875},
                                  {.125, .625, .375},
                                  {.1875, .3125, .9375},
                                  {.6875, .8125, .4375}};
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 3; ++j)
      CHECK_MESSAGE(sobol(i, j, Scramble::none, 0) == expected[i][j],
                    "point " << i << ", dimension " << j + 1);
  // Further ones from an independent implementation with the same table.
  struct Sample {
    int index, dimension;
    double value;
  };
  for (const Sample& s : {Sample{5, 10, 0.125},
                          {777, 512, 0.7978515625},
                          {1000, 256, 0.2490234375},
                          {1023, 101, 0.2373046875},
                          {13, 64, 0.0625}})
    CHECK_MESSAGE(sobol(s.index, s.dimension - 1, Scramble::none, 0) == s.value, "dimension " << s.dimension);
}

TEST_CASE("every dimension is stratified: 2^m points, one in each cell of width 2^-m, scrambled or not") {
  constexpr int n = 256;
  for (Scramble scramble : {Scramble::none, Scramble::digital, Scramble::owen})
    for (int j = 0; j < most_sobol_dimensions; j += 37) {
      std::vector<int> hits(n);
      for (int i = 0; i < n; ++i) ++hits[static_cast<int>(sobol(i, j, scramble, 9) * n)];
      for (int c : hits) REQUIRE(c == 1);
    }
}

TEST_CASE("the first two dimensions are a (0, m, 2)-net, also after scrambling") {
  constexpr int m = 8;
  for (Scramble scramble : {Scramble::none, Scramble::digital, Scramble::owen})
    for (int k = 0; k <= m; ++k) {  // cells of 2^-k by 2^-(m-k)
      std::vector<int> hits(1 << m);
      for (int i = 0; i < 1 << m; ++i) {
        const int row = static_cast<int>(std::ldexp(sobol(i, 0, scramble, 4), k));
        const int column = static_cast<int>(std::ldexp(sobol(i, 1, scramble, 4), m - k));
        ++hits[(row << (m - k)) + column];
      }
      for (int c : hits) REQUIRE(c == 1);
    }
}

TEST_CASE("scrambled points integrate a smooth function far better than random ones") {
  // ∏ (1 + (x_j - ½)/2) has the integral 1; a sample of 1024 random points has a standard error of 1e-2.
  for (Scramble scramble : {Scramble::digital, Scramble::owen}) {
    double sum = 0;
    for (int i = 0; i < 1024; ++i) {
      double f = 1;
      for (int j = 0; j < 5; ++j) f *= 1 + (sobol(i, j, scramble, 11) - 0.5) / 2;
      sum += f / 1024;
    }
    CHECK(std::fabs(sum - 1) < 1e-3);
  }
}

TEST_CASE("Halton: van der Corput numbers in the first primes, stratified after scrambling") {
  CHECK(halton(1, 0, Scramble::none, 0) == 0.5);
  CHECK(halton(6, 0, Scramble::none, 0) == 0.375);                               // 110₂ → 0.011₂
  CHECK(halton(5, 1, Scramble::none, 0) == doctest::Approx(2.0 / 3 + 1.0 / 9));  // 12₃ → 0.21₃
  CHECK(halton(7, 3, Scramble::none, 0) == doctest::Approx(1.0 / 49));           // 10₇ → 0.01₇
  const int bases[] = {2, 3, 5, 7, 11};
  for (int j = 0; j < 5; ++j) {
    const int n = bases[j] * bases[j];
    std::vector<int> hits(n);
    for (int i = 0; i < n; ++i) ++hits[static_cast<int>(halton(i, j, Scramble::owen, 3) * n)];
    for (int c : hits) CHECK(c == 1);
  }
}

}  // namespace pendula::sobol_test
