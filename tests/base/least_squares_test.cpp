// The trust-region method against the collection of Moré, Garbow & Hillstrom (ACM TOMS 7(1), 1981).
#include "base/search/least_squares.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <complex>

namespace pendula::least_squares_test {

using Eigen::Index;

namespace {

using Complex = std::complex<double>;
using ComplexVec = Eigen::VectorXcd;
using Residuals = std::function<ComplexVec(const ComplexVec&)>;

/// ½‖r‖² with the Jacobian by complex steps: Im r(x + i h eᵢ)/h, without cancellation.
SmoothFunction half_square(const Residuals& r) {
  return [r](Vec& x) -> std::optional<QuadraticModel> {
    constexpr double h = 1e-100;
    const Vec at = r(x.cast<Complex>()).real();
    Mat J(at.size(), x.size());
    for (Index i = 0; i < x.size(); ++i) {
      ComplexVec aside = x.cast<Complex>();
      aside[i] += Complex(0, h);
      J.col(i) = r(aside).imag() / h;
    }
    if (!at.allFinite() || !J.allFinite()) return {};
    return gauss_newton_model(J, at);
  };
}

ComplexVec list(std::initializer_list<Complex> entries) {
  return Eigen::Map<const ComplexVec>(entries.begin(), static_cast<Index>(entries.size()));
}

Vec vec(std::initializer_list<double> list) {
  return Eigen::Map<const Vec>(list.begin(), static_cast<Index>(list.size()));
}

struct Case {
  const char* name;
  Residuals r;
  Vec start;
  double sum;  ///< Σ r² at the minimum
};

const double bard_y[] = {0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39,
                         0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39};
const double kowalik_y[] = {0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627,
                            0.0456, 0.0342, 0.0323, 0.0235, 0.0246};
const double kowalik_u[] = {4, 2, 1, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625};
const double meyer_y[] = {34780, 28610, 23650, 19630, 16370, 13720, 11540, 9744,
                          8261,  7030,  6005,  5147,  4427,  3820,  3307,  2872};

std::vector<Case> cases() {
  return {
      {"Rosenbrock",
       [](const ComplexVec& x) {
         return list({10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]});
       },
       vec({-1.2, 1}), 0},
      {"Powell badly scaled",
       [](const ComplexVec& x) {
         return list({1e4 * x[0] * x[1] - 1.0, std::exp(-x[0]) + std::exp(-x[1]) - 1.0001});
       },
       vec({0, 1}), 0},
      {"Brown badly scaled",
       [](const ComplexVec& x) {
         return list({x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0});
       },
       vec({1, 1}), 0},
      {"Beale",
       [](const ComplexVec& x) {
         return list({1.5 - x[0] * (1.0 - x[1]), 2.25 - x[0] * (1.0 - x[1] * x[1]),
                      2.625 - x[0] * (1.0 - x[1] * x[1] * x[1])});
       },
       vec({1, 1}), 0},
      {"Bard",
       [](const ComplexVec& x) {
         ComplexVec r(15);
         for (int i = 0; i < 15; ++i) {
           const double u = i + 1, v = 15 - i, w = std::min(u, v);
           r[i] = bard_y[i] - (x[0] + u / (v * x[1] + w * x[2]));
         }
         return r;
       },
       vec({1, 1, 1}), 8.21487e-3},
      {"Kowalik & Osborne",
       [](const ComplexVec& x) {
         ComplexVec r(11);
         for (int i = 0; i < 11; ++i) {
           const double u = kowalik_u[i];
           r[i] = kowalik_y[i] - x[0] * (u * u + u * x[1]) / (u * u + u * x[2] + x[3]);
         }
         return r;
       },
       vec({0.25, 0.39, 0.415, 0.39}), 3.07505e-4},
      {"Meyer",
       [](const ComplexVec& x) {
         ComplexVec r(16);
         for (int i = 0; i < 16; ++i)
           r[i] = x[0] * std::exp(x[1] / (45.0 + 5.0 * (i + 1) + x[2])) - meyer_y[i];
         return r;
       },
       vec({0.02, 4000, 250}), 87.9458},
  };
}

}  // namespace

TEST_CASE("known minima are found") {
  for (const Case& c : cases()) {
    CAPTURE(c.name);
    MinimiserOptions options;
    options.iterations = 1000;
    const Minimum m = minimise(half_square(c.r), c.start, options);
    CAPTURE(ending_text(m));
    CAPTURE(m.iterations);
    CHECK(m.converged());
    CHECK(2 * m.value == doctest::Approx(c.sum).epsilon(1e-5));
    if (c.sum == 0) CHECK(2 * m.value < 1e-8);
  }
}

TEST_CASE("the minimum does not depend on the units of the parameters") {
  const Case c = cases()[5];
  const Minimum plain = minimise(half_square(c.r), c.start, {});
  const Vec units = vec({1e-9, 1e6, 1e3, 1e-2});
  const Minimum scaled =
      minimise(half_square([&](const ComplexVec& x) { return c.r(x.cwiseProduct(units.cast<Complex>())); }),
               c.start.cwiseQuotient(units), {});
  CHECK((scaled.theta.cwiseProduct(units) - plain.theta).norm() < 1e-6 * plain.theta.norm());
}

TEST_CASE("the verdict tells a minimum from an edge, a kink and a limit") {
  const auto bounded = [](Vec& x) -> std::optional<QuadraticModel> {
    if (x[0] > 1) return {};
    return gauss_newton_model(Mat::Constant(1, 1, 1), x - vec({2}));
  };
  const Minimum edge = minimise(bounded, vec({0}), {});
  CHECK(edge.ending == Ending::boundary);
  CHECK(edge.theta[0] == doctest::Approx(1).epsilon(1e-6));

  const auto kink = [](Vec& x) -> std::optional<QuadraticModel> {
    return newton_model(std::fabs(x[0]), vec({x[0] < 0 ? -1.0 : 1.0}), Mat::Constant(1, 1, 0));
  };
  CHECK_FALSE(minimise(kink, vec({1}), {}).converged());

  MinimiserOptions few;
  few.iterations = 3;
  const Minimum limited = minimise(half_square(cases()[0].r), cases()[0].start, few);
  CHECK(limited.ending == Ending::iterations);
  CHECK(ending_text(limited) == "stopped after 3 iterations before it converged");
}

TEST_CASE("a parameter without effect stays where it is") {
  const auto V = half_square([](const ComplexVec& x) {
    return list({x[0] - 3.0, 2.0 * (x[0] - 3.0) + 1.0});
  });
  const Minimum m = minimise(V, vec({0, 7}), {});
  CHECK(m.converged());
  CHECK(m.theta[1] == 7);
}

TEST_CASE("a large residual: convergence although JᵀJ is a poor model of the curvature") {
  // r = (x + 1, λx² + x - 1): ∇²V = JᵀJ + 2λ r₂ (Dennis & Schnabel, example 10.2.4);
  // Gauss–Newton alone is slow
  for (const double lambda : {0.1, 0.4, -0.7}) {
    const auto V = half_square([=](const ComplexVec& x) {
      return list({x[0] + 1.0, lambda * x[0] * x[0] + x[0] - 1.0});
    });
    const Minimum m = minimise(V, vec({1}), {});
    CHECK(m.converged());
    CHECK(std::fabs(m.theta[0]) < 1e-6);
  }
}

}  // namespace pendula::least_squares_test
