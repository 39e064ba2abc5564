// Prediction-error models: gradients against differences, recovery, what the search returns is a minimum.
#include "sysid/fit/pem.hpp"

#include <random>

#include <doctest/doctest.h>

#include "sysid/fit/order_scan.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::pem_test {

using namespace pendula::sysid;

namespace {

/// A y = B/F u + C/D e from rest, two inputs.
IdData record(Index n, unsigned seed, double noise, const Polynomials& p) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  IdData d;
  d.u = Mat(n, static_cast<Index>(p.B.size()));
  Vec e(n);
  for (Index t = 0; t < n; ++t) {
    e[t] = noise * normal(generator);
    for (Index i = 0; i < d.u.cols(); ++i) d.u(t, i) = normal(generator);
  }
  Vec sum = filtered(p.C, p.D, e);
  for (std::size_t i = 0; i < p.B.size(); ++i)
    sum += filtered(p.B[i], p.F[i], d.u.col(static_cast<Index>(i)));
  d.y = filtered(Vec::Ones(1), p.A, sum);
  return checked(std::move(d));
}

Vec list(std::initializer_list<double> values) {
  return Eigen::Map<const Vec>(values.begin(), static_cast<Index>(values.size()));
}

Polynomials system_of(bool a, bool c, bool d, bool f) {
  Polynomials p;
  if (a) p.A = list({1, -0.6});
  if (c) p.C = list({1, 0.5});
  if (d) p.D = list({1, -0.4, 0.2});
  p.B = {list({0, 1, 0.5}), list({0, 0, -2})};
  p.F = {f ? list({1, -1.2, 0.5}) : list({1}), f ? list({1, 0.3}) : list({1})};
  return p;
}

Orders orders_of(const Polynomials& p) {
  Orders o;
  o.na = static_cast<int>(p.A.size()) - 1;
  o.nc = static_cast<int>(p.C.size()) - 1;
  o.nd = static_cast<int>(p.D.size()) - 1;
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    Index nk = 0;
    while (nk < p.B[i].size() && p.B[i][nk] == 0) ++nk;
    if (nk == p.B[i].size()) nk = 0;
    o.nk.push_back(static_cast<int>(nk));
    o.nb.push_back(static_cast<int>(p.B[i].size() - nk));
    o.nf.push_back(static_cast<int>(p.F[i].size()) - 1);
  }
  return o;
}

}  // namespace

TEST_CASE("pem: gradients agree with central differences") {
  const Polynomials p = system_of(true, true, true, true);
  const IdData d = record(60, 1, 0.3, p);
  const Orders o = orders_of(p);
  for (const InitialCondition start : {InitialCondition::zero, InitialCondition::drop}) {
    Vec theta = parameters_of(p, o);
    for (Index i = 0; i < theta.size(); ++i) theta[i] += 0.05 * std::sin(3.0 * static_cast<double>(i));
    const PredictionErrors at = prediction_errors(d, 0, o, theta, start, true);
    for (Index i = 0; i < theta.size(); ++i) {
      Vec up = theta, down = theta;
      const double h = 1e-5;
      up[i] += h, down[i] -= h;
      const Vec slope = (prediction_errors(d, 0, o, up, start, false).e -
                         prediction_errors(d, 0, o, down, start, false).e) /
                        (2 * h);
      CAPTURE(i);
      CHECK((slope - at.J.col(i)).norm() <=
            1e-8 * (1 + slope.norm()));  // h² and ε/h are 1e-10, third derivatives below 100
    }
  }
}

TEST_CASE("pem: with a fitted initial state the gradient of the loss agrees with differences") {
  const Polynomials p = system_of(true, true, true, true);
  const IdData d = record(60, 2, 0.3, p);
  const Orders o = orders_of(p);
  Vec theta = parameters_of(p, o);
  for (Index i = 0; i < theta.size(); ++i) theta[i] += 0.05 * std::cos(2.0 * static_cast<double>(i));
  const PredictionErrors at = prediction_errors(d, 0, o, theta, InitialCondition::estimate, true);
  const Vec g = 2 * at.J.transpose() * at.e;
  for (Index i = 0; i < theta.size(); ++i) {
    Vec up = theta, down = theta;
    up[i] += 1e-5, down[i] -= 1e-5;
    const double slope =
        (prediction_errors(d, 0, o, up, InitialCondition::estimate, false).e.squaredNorm() -
         prediction_errors(d, 0, o, down, InitialCondition::estimate, false).e.squaredNorm()) /
        2e-5;
    CAPTURE(i);
    CHECK(std::abs(slope - g[i]) <= 1e-6 * (1 + g.norm()));
  }
}

TEST_CASE("pem: noise-free data give B/F to rounding, from rest and from the middle of a record") {
  const Polynomials p = system_of(false, false, false, true);
  const IdData d = record(400, 3, 0, p);
  for (const IdData& part : {d, slice(d, 101, 400)}) {
    const PolyModel m = pem(part, 0, orders_of(p), "OE", {});
    CHECK((m.theta - parameters_of(p, orders_of(p))).norm() <= 1e-11);
    CHECK(m.exact);
  }
}

TEST_CASE("pem: estimates lie within four standard deviations of the truth, and these have the right size") {
  struct Case {
    const char* kind;
    Polynomials p;
  };
  for (const Case& c :
       {Case{"ARMAX", system_of(true, true, false, false)}, Case{"OE", system_of(false, false, false, true)},
        Case{"BJ", system_of(false, true, true, true)},
        Case{"polynomial", system_of(true, false, true, false)}}) {
    const Orders o = orders_of(c.p);
    const Vec truth = parameters_of(c.p, o);
    double sum = 0, count = 0;
    for (unsigned seed = 10; seed < 18; ++seed) {
      const IdData d = record(1000, seed, 0.3, c.p);
      const PolyModel m = pem(d, 0, o, c.kind, {});
      const Vec z = (m.theta - truth).cwiseQuotient(m.std);
      CAPTURE(c.kind);
      CAPTURE(seed);
      CHECK(z.cwiseAbs().maxCoeff() <= 4);
      CHECK(m.quality.sigma2 ==
            doctest::Approx(0.09).epsilon(0.2));  // 4 σ of a χ² with 1000 degrees of freedom
      CHECK(validate(IdModel{{m}, false, d.inputs(), nullptr}, 0, d, 25).p > 1e-4);
      sum += z.squaredNorm(), count += static_cast<double>(z.size());
    }
    CHECK(sum / count > 0.4);  // mean of ≥ 40 squares of a normal variable: 1 ± 0.22
    CHECK(sum / count < 1.9);
  }
}

TEST_CASE("chi-square tail: tabulated quantiles") {
  CHECK(chi_square_tail(3.841458820694124, 1) == doctest::Approx(0.05).epsilon(1e-12));
  CHECK(chi_square_tail(37.65248413348277, 25) == doctest::Approx(0.05).epsilon(1e-12));
  CHECK(chi_square_tail(10.51965216, 25) == doctest::Approx(0.995).epsilon(1e-7));
  CHECK(chi_square_tail(2 * 7.0, 2) == doctest::Approx(std::exp(-7.0)).epsilon(1e-13));
}

TEST_CASE("the scan of one factorisation gives what each model alone gives") {
  const Polynomials p = system_of(true, false, false, false);
  const IdData d = record(300, 5, 0.2, p);
  IdData one = d;
  one.u = d.u.leftCols(1), one.u_names = {"u"}, one.u_offset = one.u_slope = Vec::Zero(1);
  const OrderScan scan = order_scan(one, nullptr, {1, 3}, {1, 3}, {0, 2}, "bic");
  CHECK(scan.entries.size() == 27);
  for (const ScanEntry& e : scan.entries) {
    // The same rows: start the model alone where the largest one starts.
    Orders o;
    o.na = e.na, o.nb = {e.nb}, o.nk = {e.nk};
    const Regressor regressor(one, 0, o, InitialCondition::drop);
    const Mat phi = regressor.matrix().bottomRows(scan.rows);
    const Vec y = regressor.targets().tail(scan.rows);
    const WeightedLeastSquares ls = least_squares(phi, y, {});
    CHECK(e.estimation.sse == doctest::Approx(ls.sse).epsilon(1e-10));
  }
}

}  // namespace pendula::pem_test
