#include "method/chebyshev.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace pendula::chebyshev_test {

using pendula::integrate::Chebyshev;

TEST_CASE("Chebyshev methods: R agrees with exp up to z², for every number of stages") {
  for (int s : {2, 3, 5, 10, 40, 200}) {
    CAPTURE(s);
    const Chebyshev rk(s);
    for (double z : {1e-3, -1e-3, -1e-2})
      CHECK(std::fabs(rk.R(z) - std::exp(z)) <= std::fabs(z * z * z) + 1e-13 * s);
  }
}

TEST_CASE("Chebyshev methods: |R| ≤ 1 on [-β, 0], damped inside, and not much beyond") {
  for (int s : {2, 3, 5, 10, 40, 200}) {
    CAPTURE(s);
    const Chebyshev rk(s);
    const double beta = Chebyshev::stability_limit(s);
    for (int k = 0; k <= 2000; ++k) CHECK(std::fabs(rk.R(-beta * k / 2000)) <= 1 + 1e-10);
    for (int k = 1000; k <= 1900; ++k)  // ε = 2/13: |R| ≈ 1 - ε/3 away from the ends
      if (s > 3) CHECK(std::fabs(rk.R(-beta * k / 2000)) <= 0.97);
    CHECK(std::fabs(rk.R(-1.2 * beta)) > 1);
    CHECK(beta >= 0.6 * (s * s - 1));
  }
}

TEST_CASE("Chebyshev methods: each stage is exact for x′ = 1 at its own time") {
  for (int s : {2, 3, 7, 60}) {
    const Chebyshev rk(s);
    double before = 0, now = rk.stage[1].slope;
    CHECK(std::fabs(now - rk.stage[1].c) <= 1e-12);
    for (int j = 2; j <= s; ++j) {
      const Chebyshev::Stage& row = rk.stage[static_cast<std::size_t>(j)];
      const double next = row.mu * now + row.nu * before + row.slope + row.first_slope;
      before = now;
      now = next;
      CHECK(std::fabs(now - row.c) <= 1e-11);
    }
    CHECK(now == doctest::Approx(1));
  }
}

TEST_CASE("Chebyshev methods: as many stages as the spectrum asks for") {
  for (double z : {0.0, 1.0, 2.0, 10.0, 1e3, 1e6}) {
    const int s = Chebyshev::stages_for(z);
    CHECK(Chebyshev::stability_limit(s) >= z);
    if (s > 2) CHECK(Chebyshev::stability_limit(s - 1) < z);
  }
}

}  // namespace pendula::chebyshev_test
