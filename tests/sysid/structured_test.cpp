// Least squares on shifted signals: two roads to the same digits, and what rank deficiency looks like.
#include "sysid/regression/structured.hpp"

#include <random>

#include <doctest/doctest.h>

#include "sysid/data/excitation.hpp"
#include "sysid/model/model.hpp"

namespace pendula::structured_test {

using namespace pendula::sysid;

namespace {

IdData random_arx(Index n, unsigned seed, double noise) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  IdData d;
  d.y = Mat::Zero(n, 1), d.u = Mat::Zero(n, 1);
  for (Index t = 0; t < n; ++t) {
    d.u(t, 0) = normal(generator);
    double y = noise * normal(generator);
    if (t >= 2) y += 1.5 * d.y(t - 1, 0) - 0.7 * d.y(t - 2, 0) + d.u(t - 1, 0) + 0.5 * d.u(t - 2, 0);
    d.y(t, 0) = y;
  }
  return checked(std::move(d));
}

Orders siso(int na, int nb, int nk) {
  Orders o;
  o.na = na, o.nb = {nb}, o.nk = {nk};
  return o;
}

}  // namespace

TEST_CASE(
    "structured: the Gram matrix with one refinement has the digits of QR, for every start and with gaps") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    IdData d = random_arx(3000, seed, 0.1);
    if (seed == 2) d.starts = {0, 700, 1500};
    if (seed == 3) d.y(100, 0) = d.u(2000, 0) = NAN;
    for (const InitialCondition start :
         {InitialCondition::drop, InitialCondition::zero, InitialCondition::estimate})
      for (const Orders& o : {siso(2, 2, 1), siso(10, 10, 1), siso(0, 7, 3), siso(5, 0, 1), siso(1, 3, 0)}) {
        CAPTURE(seed);
        CAPTURE(o.na);
        CAPTURE(o.nb[0]);
        const Regressor regressor(d, 0, o, start);
        const LeastSquares qr = solve_blocked(regressor), fast = solve_structured(regressor).value();
        REQUIRE(fast.rank == regressor.columns());
        CHECK(fast.rows == qr.rows);
        // Condition below 100: a backward stable solution errs by a few hundred ε.
        CHECK((fast.theta - qr.theta).norm() <= 1e-13 * qr.theta.norm());
        CHECK(fast.sse == doctest::Approx(qr.sse).epsilon(1e-12));
        CHECK((fast.inverse - qr.inverse).norm() <= 1e-11 * qr.inverse.norm());
      }
  }
}

TEST_CASE("structured: noise-free data give the parameters to rounding") {
  const IdData d = random_arx(5000, 7, 0);
  const Regressor regressor(d, 0, siso(2, 2, 1), InitialCondition::drop);
  const Vec truth = (Vec(4) << -1.5, 0.7, 1, 0.5).finished();
  for (const LeastSquares& ls : {solve_structured(regressor).value(), solve_blocked(regressor)}) {
    CHECK((ls.theta - truth).norm() <= 1e-13);
    CHECK(ls.exact());
  }
}

TEST_CASE("structured: bad conditioning is left to QR") {
  IdData d = random_arx(3000, 5, 0.1);
  d.u.setOnes();
  const Regressor regressor(d, 0, siso(0, 2, 1), InitialCondition::drop);
  CHECK(!solve_structured(regressor));
  const LeastSquares ls = solve_regression(regressor);
  CHECK(ls.rank == 1);
  CHECK(ls.theta[0] == doctest::Approx(ls.theta[1]));  // minimum norm shares equally
  CHECK(free_directions(ls.null_space, regressor.names())[0] ==
        "only b1 + b2 is determined: (b1, b2) + α (1, -1) predicts the same for every α");
}

TEST_CASE("regressor: φ(t) as the header says") {
  const IdData d = random_arx(6, 1, 1);
  const Regressor regressor(d, 0, siso(2, 2, 1), InitialCondition::drop);
  CHECK(regressor.rows() == 4);
  double phi[4];
  regressor.row(3, 0, phi);
  CHECK(phi[0] == -d.y(2, 0));
  CHECK(phi[1] == -d.y(1, 0));
  CHECK(phi[2] == d.u(2, 0));
  CHECK(phi[3] == d.u(1, 0));
  CHECK(regressor.names() == std::vector<std::string>{"a1", "a2", "b1", "b2"});
  const Mat full = regressor.matrix();
  CHECK(full.row(1) == Eigen::Map<const Eigen::RowVectorXd>(phi, 4));
  regressor.row(0, 0, phi);
  for (const double v : phi) CHECK(v == 0);
}

TEST_CASE("excitation: a constant has order 1, a sine order 2, noise any") {
  IdData d = random_arx(400, 3, 0);
  CHECK(excitation_order(d, 0, 30) == 30);
  for (Index t = 0; t < 400; ++t) d.u(t, 0) = 1;
  CHECK(excitation_order(d, 0, 30) == 1);
  for (Index t = 0; t < 400; ++t) d.u(t, 0) = std::sin(0.3 * static_cast<double>(t));
  CHECK(excitation_order(d, 0, 30) == 2);
  d.u.setZero();
  CHECK(excitation_order(d, 0, 30) == 0);
}

TEST_CASE("residuals are orthogonal to the regressors") {
  const IdData d = random_arx(500, 11, 1);
  const Regressor regressor(d, 0, siso(3, 2, 1), InitialCondition::drop);
  const PolyModel m = arx(d, 0, siso(3, 2, 1), InitialCondition::drop);
  const Vec e = predict(m, d, 1, Seed::data).errors;
  const Mat phi = regressor.matrix();
  REQUIRE(e.size() == phi.rows());
  for (Index i = 0; i < phi.cols(); ++i)
    CHECK(std::abs(phi.col(i).dot(e)) <= 1e-12 * phi.col(i).norm() * e.norm());
}

}  // namespace pendula::structured_test
