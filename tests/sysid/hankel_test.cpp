// Triangular factors of block Hankel matrices: by moments and by rows they belong to the same matrix.
#include <doctest/doctest.h>

#include <random>

#include "sysid/fit/hankel.hpp"

namespace pendula::hankel_test {

using namespace pendula::sysid;

namespace {

/// Two inputs, one output with two poles, in experiments of 60, 8 (a single window) and 90 samples.
IdData record(double offset, double noise) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  IdData d;
  d.starts = {0, 60, 68};
  d.u = Mat(158, 2), d.y = Mat(158, 1);
  double x = 0;
  for (Index t = 0; t < d.u.rows(); ++t) {
    d.u.row(t) << normal(generator), 1e-3 * normal(generator);
    d.y(t, 0) = offset + x + noise * normal(generator);
    x = 0.8 * x + d.u(t, 0) - 40 * d.u(t, 1);
  }
  return checked(std::move(d));
}

/// Every window written out.
Mat windows(const IdData& d, Index i, Index without_last) {
  Mat H(0, 2 * i * (d.inputs() + d.outputs()));
  for (Index k = 0; k < d.experiments(); ++k)
    for (Index t = d.starts[k] + i; t + i + without_last <= d.end(k); ++t) {
      H.conservativeResize(H.rows() + 1, Eigen::NoChange);
      Index at = 0;
      for (Index s = 0; s < i; ++s)
        for (Index j = 0; j < d.inputs(); ++j) H(H.rows() - 1, at++) = d.u(t + s, j);
      for (Index s = 1; s <= i; ++s) {
        for (Index j = 0; j < d.inputs(); ++j) H(H.rows() - 1, at++) = d.u(t - s, j);
        for (Index j = 0; j < d.outputs(); ++j) H(H.rows() - 1, at++) = d.y(t - s, j);
      }
      for (Index s = 0; s < i; ++s)
        for (Index j = 0; j < d.outputs(); ++j) H(H.rows() - 1, at++) = d.y(t + s, j);
    }
  return H;
}

}  // namespace

TEST_CASE(
    "Hankel factors: RᵀR are the moments of the windows, with and without the last of each experiment") {
  // An offset of 1e6 or data without noise leave too few digits to the moments: orthogonal transformations.
  for (const auto& [shift, deviation] : {std::pair{0.0, 0.1}, {1e6, 0.1}, {0.0, 0.0}}) {
    const double offset = shift, noise = deviation;
    CAPTURE(offset);
    CAPTURE(noise);
    const IdData d = record(offset, noise);
    const Hankel h = hankel(d, 4);
    CHECK(h.ends == 3);
    CHECK(h.windows == 53 + 1 + 83);
    const Mat all = windows(d, 4, 0), shorter = windows(d, 4, 1);
    REQUIRE(all.rows() == h.windows);
    const double size = all.squaredNorm();
    CHECK((h.R.transpose() * h.R - all.transpose() * all).norm() < 1e-13 * size);
    CHECK((h.shorter.transpose() * h.shorter - shorter.transpose() * shorter).norm() < 1e-13 * size);
    CHECK(h.R.isUpperTriangular());
    if (noise == 0) CHECK(h.R33().norm() < 1e-12 * h.y_size());
  }
}

}  // namespace pendula::hankel_test
