// Products between lanes against Eigen.
#include <vector>

#include <doctest/doctest.h>

#include "base/math.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/routines/lane_product.hpp"
#include "tests/require_code.hpp"

namespace pendula::lane_product_test {

using namespace pendula::codegen;

TEST_CASE("lane products: every number of rows, terms and vectors") {
  REQUIRE_CODE(4);
  for (const int terms : {1, 3, 7})
    for (const int size : {1, 2, 3, 4, 5, 9, 16})
      for (const bool both : {false, true}) {
        const Mat A = Mat::Random(8, terms), X = Mat::Random(terms, size);
        const Vec scale = Vec::Random(size);
        const Mat rows = A.topRows(both ? 8 : 4);
        LaneArray columns(static_cast<std::size_t>(8 * terms));
        std::copy_n(A.data(), A.size(), columns.data());
        constexpr std::size_t stride = 3;  // of the vectors
        std::vector<std::vector<double>> vectors;
        std::vector<const double*> from;
        for (int j = 0; j < terms; ++j) {
          vectors.emplace_back(stride * static_cast<std::size_t>(size), NAN);
          for (int k = 0; k < size; ++k) vectors.back()[stride * static_cast<std::size_t>(k)] = X(j, k);
        }
        for (const auto& v : vectors) from.push_back(v.data());
        const LaneTerms q{columns.data(), from.data(), static_cast<std::size_t>(terms), stride,
                          static_cast<std::size_t>(size)};
        Mat low = Mat::Zero(4, size), high = Mat::Zero(4, size);
        const LaneRows to{low.data(), both ? high.data() : nullptr, 4};
        const auto result = [&] {
          Mat all(rows.rows(), size);
          all.topRows(4) = low;
          if (both) all.bottomRows(4) = high;
          return all;
        };
        assign_lane_product(q, to);
        CHECK((result() - rows * X).cwiseAbs().maxCoeff() < 1e-14);
        if (!both) CHECK(high.isZero(0));
        double sum = 0, largest = 0;
        add_lane_product(q, scale.data(), to, sum, largest);
        CHECK((result() - 2 * rows * X).cwiseAbs().maxCoeff() < 1e-14);
        const Mat scaled = rows * X * scale.asDiagonal();
        CHECK(sum == doctest::Approx(scaled.squaredNorm()).epsilon(1e-12));
        CHECK(largest == doctest::Approx(scaled.cwiseAbs2().maxCoeff()).epsilon(1e-12));
      }
}

}  // namespace pendula::lane_product_test
