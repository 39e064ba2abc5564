// Rows and columns divided by their largest entries.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "dae/rank/rank_with_gap.hpp"

namespace equilibration_test {

using pendula::Mat;
using pendula::Vec;

Mat random_matrix(std::mt19937& random, Eigen::Index rows, Eigen::Index columns) {
  std::uniform_real_distribution<double> decades(-150, 150);
  std::bernoulli_distribution occupied(0.3), negative(0.5);
  return Mat::NullaryExpr(rows, columns, [&] {
    return occupied(random) ? std::copysign(std::pow(10, decades(random)), negative(random) ? -1 : 1) : 0.0;
  });
}

TEST_CASE("after one division of rows and columns a second one changes no bit") {
  std::mt19937 random(20261130);
  for (int k = 0; k < 500; ++k) {
    const Mat given = random_matrix(random, 1 + k % 7, 1 + k % 5);
    Mat once = given;
    const auto first = pendula::dae::divide_by_largest(once);
    CHECK((first.rows.array() > 0).all());
    CHECK((first.columns.array() > 0).all());
    for (Eigen::Index i = 0; i < once.rows(); ++i)
      CHECK(once.row(i).cwiseAbs().maxCoeff() == (given.row(i).any() ? 1 : 0));
    for (Eigen::Index j = 0; j < once.cols(); ++j)
      CHECK(once.col(j).cwiseAbs().maxCoeff() == (given.col(j).any() ? 1 : 0));
    Mat twice = once;
    const auto second = pendula::dae::divide_by_largest(twice);
    CHECK(twice == once);
    CHECK(second.rows == Vec::Ones(once.rows()));
    CHECK(second.columns == Vec::Ones(once.cols()));
  }
}

TEST_CASE("the divisors restore the matrix") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-2, 2);
  const Mat given = Mat::NullaryExpr(4, 3, [&] { return number(random); });
  Mat m = given;
  const auto largest = pendula::dae::divide_by_largest(m);
  const Mat back = largest.rows.asDiagonal() * m * largest.columns.asDiagonal();
  CHECK((back - given).cwiseAbs().maxCoeff() < 1e-15);  // two divisions and two products of numbers below 2
}

}  // namespace equilibration_test
