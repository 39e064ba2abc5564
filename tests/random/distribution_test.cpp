// Quantiles, distribution functions, joint distributions, samples.
#include "random/distribution.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.hpp"
#include "random/data.hpp"
#include "random/philox.hpp"
#include "random/sample_space.hpp"
#include "random/special.hpp"

namespace pendula::distribution_test {

using namespace pendula::random;

namespace {

std::vector<DistributionPtr> continuous() {
  return {normal(3, 0.5),       lognormal(-1, 0.8),    uniform(-2, 5),   triangular(0, 1, 4),
          triangular(0, 0, 1),  triangular(-1, 2, 2),  beta(2, 3, 0, 1), beta(0.5, 0.5, -1, 1),
          beta(40, 0.7, 0, 10), beta(500, 2000, 0, 1), exponential(3)};
}

/// ∫₀¹ f(u) du by Gauss–Legendre of two points in cells that shrink towards both ends.
double mean_over_unit(const std::function<double(double)>& f) {
  double sum = 0;
  const int cells = 4000;
  const auto map = [](double s) { return s * s * s * (10 - 15 * s + 6 * s * s); };
  for (int k = 0; k < cells; ++k)
    for (double node : {0.21132486540518713, 0.7886751345948129}) {
      const double s = (k + node) / cells, slope = 30 * s * s * (1 - s) * (1 - s);
      sum += f(map(s)) * slope / (2 * cells);
    }
  return sum;
}

}  // namespace

TEST_CASE("normal quantiles: 16 digits, also far out") {
  // Reference: Cephes ndtri by way of SciPy 1.10.
  const std::pair<double, double> table[] = {{1e-300, -37.0470962993612}, {1e-20, -9.262340089798409},
                                             {1e-5, -4.264890793922825},  {0.02, -2.053748910631823},
                                             {0.3, -0.5244005127080409},  {0.77, 0.7388468491852137},
                                             {0.999, 3.090232306167813}};
  for (const auto& [p, x] : table) CHECK(normal_quantile(p) == doctest::Approx(x).epsilon(2e-15));
  CHECK(normal_quantile(0.5) == 0);
  CHECK(std::isinf(normal_quantile(0)));
  CHECK(std::isnan(normal_quantile(1.5)));
}

TEST_CASE("beta quantiles against a reference") {
  struct Sample {
    double a, b, p, x;
  };
  for (const Sample& s : {Sample{2, 3, 0.1, 0.14255931671003072},
                          {0.5, 0.5, 0.3, 0.2061073738537634},
                          {20, 1.5, 1e-6, 0.4686776043532852},
                          {0.1, 7, 0.5, 9.050320582424038e-05},
                          {1000, 2000, 0.975, 0.35030301672719677},
                          {5, 1, 0.999999, 0.99999979999992}})
    CHECK_MESSAGE(beta_quantile(s.a, s.b, s.p) == doctest::Approx(s.x).epsilon(1e-12),
                  s.a << " " << s.b << " " << s.p);
}

TEST_CASE("F(F⁻¹(u)) = u, monotone, with the mean and deviation that are told") {
  for (const auto& d : continuous()) {
    double before = -INFINITY;
    for (double u : {1e-12, 1e-6, 0.001, 0.1, 0.25, 0.5, 0.75, 0.9, 0.999, 1 - 1e-6}) {
      const double x = d->quantile(u);
      CHECK_MESSAGE(d->cdf(x) == doctest::Approx(u).epsilon(1e-9), d->code() << " at " << u);
      CHECK(x >= before);
      before = x;
    }
    const double mean = mean_over_unit([&](double u) { return d->quantile(u); });
    CHECK_MESSAGE(mean == doctest::Approx(d->mean()).epsilon(1e-4), d->code());
    const double square = mean_over_unit([&](double u) { return std::pow(d->quantile(u) - d->mean(), 2); });
    CHECK_MESSAGE(std::sqrt(square) == doctest::Approx(d->deviation()).epsilon(1e-3), d->code());
  }
}

TEST_CASE("samples pass the Kolmogorov–Smirnov test, in every design that is random") {
  using Kind = DesignRequest::Kind;
  for (Kind kind : {Kind::monte_carlo, Kind::latin_hypercube, Kind::sobol, Kind::halton})
    for (const auto& d : continuous()) {
      DesignRequest request;
      request.kind = kind, request.runs = 2000, request.seed = 7;
      Column column;
      column.name = "x", column.distribution = d;
      const SampleSpace space({column}, false, request);
      std::vector<double> F;
      for (long run = 0; run < space.runs(); ++run) F.push_back(d->cdf(space.value(0, run)));
      std::sort(F.begin(), F.end());
      const double D = kolmogorov_smirnov(F);
      CHECK_MESSAGE(kolmogorov_smirnov_p(D, space.runs()) > 0.01, d->code()
                                                                      << ", " << name_of(kind) << ", seed 7");
      // Even designs are much closer than random ones: D < 3/n in place of 1/√n.
      if (kind != Kind::monte_carlo) CHECK_MESSAGE(D < 0.004, d->code() << ", " << name_of(kind));
    }
}

TEST_CASE("discrete and empirical distributions") {
  const auto d = discrete({3, 1, 2}, {1, 0, 3});
  CHECK(d->quantile(0.5) == 2);
  CHECK(d->quantile(0.76) == 3);
  CHECK(d->quantile(1e-9) == 2);  // 1 has no weight
  CHECK(d->mean() == doctest::Approx(2.25));
  const auto e = empirical({5, 5, 7, 9});
  CHECK(e->quantile(0.5) == 5);
  CHECK(e->quantile(0.51) == 7);
  CHECK(e->cdf(6) == 0.5);
  CHECK(e->code() == "empirical({5, 5, 7, 9})");
}

TEST_CASE("several normal numbers have the covariance that was given, also a singular one") {
  Mat S(3, 3);
  S << 4, 1.2, -0.8, 1.2, 1, 0.1, -0.8, 0.1, 0.5;
  Mat rank1(3, 3);
  rank1 << 1, 2, -1, 2, 4, -2, -1, -2, 1;
  for (const Mat& covariance : {S, rank1, Mat(1e-12 * S)}) {
    Vec m(3);
    m << 1, -2, 3;
    const auto joint = std::make_shared<const JointNormal>(m, covariance);
    std::vector<Column> columns(3);
    for (int i = 0; i < 3; ++i)
      columns[i].name = std::string(1, 'a' + i), columns[i].joint = joint, columns[i].component = i;
    DesignRequest request;
    request.kind = DesignRequest::Kind::sobol, request.runs = 1 << 14;
    const SampleSpace space(columns, false, request);
    CHECK(space.design()->request().dimensions == 3);
    Mat values(space.runs(), 3);
    for (long run = 0; run < space.runs(); ++run)
      for (int i = 0; i < 3; ++i) values(run, i) = space.value(i, run);
    const Vec mean = values.colwise().mean();
    const Mat centred = values.rowwise() - mean.transpose();
    const Mat measured = centred.transpose() * centred / static_cast<double>(space.runs());
    CHECK((measured - covariance).cwiseAbs().maxCoeff() < 0.01 * covariance.cwiseAbs().maxCoeff());
  }
  CHECK_THROWS_WITH_AS(JointNormal(Vec::Zero(2), (Mat(2, 2) << 1, 2, 2, 1).finished()),
                       doctest::Contains("eigenvalue -1"), Error);
  CHECK_THROWS_WITH_AS(JointNormal(Vec::Zero(2), (Mat(2, 2) << 1, 2, 0, 1).finished()),
                       doctest::Contains("not symmetric"), Error);
}

TEST_CASE("designs: Latin hypercubes, grids, stars, base points with exchanged coordinates, trajectories") {
  using Kind = DesignRequest::Kind;
  DesignRequest r;
  r.dimensions = 3, r.runs = 50, r.kind = Kind::latin_hypercube;
  const Design latin(r);
  for (int j = 0; j < 3; ++j) {
    std::vector<int> hits(50);
    for (int i = 0; i < 50; ++i) ++hits[static_cast<int>(latin.unit(i, j) * 50)];
    for (int c : hits) CHECK(c == 1);
  }
  r.runs = 0, r.levels = 3, r.kind = Kind::grid;
  const Design grid(r);
  CHECK(grid.runs() == 27);
  CHECK(grid.unit(5, 2) == doctest::Approx(5.0 / 6));
  CHECK(grid.unit(5, 0) == doctest::Approx(1.0 / 6));
  r.levels = 2, r.kind = Kind::star;
  const Design star(r);
  CHECK(star.runs() == 7);
  CHECK(star.unit(0, 1) == 0.5);
  CHECK(star.unit(3, 1) == 0.25);
  CHECK(star.unit(3, 0) == 0.5);
  r.kind = Kind::saltelli, r.runs = 4, r.levels = 0;
  const Design saltelli(r);
  CHECK(saltelli.runs() == 20);
  for (int j = 0; j < 3; ++j)
    for (int block = 0; block < 3; ++block)
      CHECK(saltelli.unit(5 + 2 + block, j) == saltelli.unit(5 + (block == j ? 1 : 0), j));
  r.kind = Kind::morris, r.runs = 6;
  const Design morris(r);
  for (int trajectory = 0; trajectory < 6; ++trajectory) {
    std::vector<int> moved(3);
    for (int step = 1; step < 4; ++step)
      for (int j = 0; j < 3; ++j) {
        const double jump = morris.unit(4 * trajectory + step, j) - morris.unit(4 * trajectory + step - 1, j);
        if (jump == 0) continue;
        ++moved[j];
        CHECK(std::fabs(jump) == doctest::Approx(0.66));
      }
    for (int m : moved) CHECK(m == 1);
  }
}

TEST_CASE("shares with intervals") {
  // Newcombe, Statist. Med. 17, 1998, table I: 15 of 148.
  const auto [low, high] = wilson(15, 148, 0.95);
  CHECK(low == doctest::Approx(0.0624).epsilon(1e-3));
  CHECK(high == doctest::Approx(0.1605).epsilon(1e-3));
  const auto [exact_low, exact_high] = clopper_pearson(15, 148, 0.95);
  CHECK(exact_low == doctest::Approx(0.0578).epsilon(1e-3));
  CHECK(exact_high == doctest::Approx(0.1617).epsilon(1e-3));
  CHECK(wilson(0, 10, 0.95).first == 0);
  CHECK(clopper_pearson(0, 10, 0.95).second == doctest::Approx(1 - std::pow(0.025, 0.1)));
  CHECK(clopper_pearson(10, 10, 0.95).first == doctest::Approx(std::pow(0.025, 0.1)));
}

TEST_CASE("sample quantiles, histograms and kernel densities") {
  const std::vector<double> v = {1, 2, 4, 8, NAN};
  const auto sorted = sorted_sample(v);
  CHECK(sorted.size() == 4);
  CHECK(sample_quantile(sorted, 0) == 1);
  CHECK(sample_quantile(sorted, 0.5) == 3);
  CHECK(sample_quantile(sorted, 1) == 8);
  const Histogram h = histogram(sorted, 7);
  CHECK(h.counts == std::vector<long>{1, 1, 0, 1, 0, 0, 1});
  const std::vector<double> equal(5, 2.0);
  CHECK(histogram(equal, 0).counts == std::vector<long>{5});
  double bandwidth = 0;
  std::vector<double> grid;
  for (int k = 0; k <= 1000; ++k) grid.push_back(-20 + 0.05 * k);
  double area = 0;
  for (double f : kernel_density(sorted, grid, bandwidth)) area += 0.05 * f;
  CHECK(area == doctest::Approx(1).epsilon(1e-6));
}

}  // namespace pendula::distribution_test
