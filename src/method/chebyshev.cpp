#include "method/chebyshev.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace pendula::integrate {

// of the cited paper: |R| ≤ 1 - damping/3 = 0.95 between the ends
static constexpr double damping = 2.0 / 13;

Chebyshev::Chebyshev(int s) : stages(s), stage(static_cast<std::size_t>(s) + 1) {
  PENDULA_ASSERT(s >= 2, "a Chebyshev method needs two stages");
  const double w0 = 1 + damping / (static_cast<double>(s) * s);
  // Tⱼ(w₀) and its first two derivatives, by the recurrence of the Chebyshev polynomials.
  std::vector<double> T = {1, w0}, T1 = {0, 1}, T2 = {0, 0};
  for (std::size_t j = 2; j < stage.size(); ++j) {
    T.push_back(2 * w0 * T[j - 1] - T[j - 2]);
    T1.push_back(2 * T[j - 1] + 2 * w0 * T1[j - 1] - T1[j - 2]);
    T2.push_back(4 * T1[j - 1] + 2 * w0 * T2[j - 1] - T2[j - 2]);
  }
  const double w1 = T1.back() / T2.back();
  std::vector<double> b(stage.size());
  for (std::size_t j = 2; j < b.size(); ++j) b[j] = T2[j] / (T1[j] * T1[j]);
  b[0] = b[2];
  b[1] = b[2];
  for (std::size_t j = 2; j < stage.size(); ++j) stage[j].c = w1 * T2[j] / T1[j];
  stage[1].c = stage[2].c / (4 * w0);
  stage.back().c = 1;
  stage[1].slope = b[1] * w1;
  for (std::size_t j = 2; j < stage.size(); ++j) {
    Stage& row = stage[j];
    row.mu = 2 * w0 * b[j] / b[j - 1];
    row.nu = -b[j] / b[j - 2];
    row.slope = 2 * w1 * b[j] / b[j - 1];
    row.first_slope = -(1 - b[j - 1] * T[j - 1]) * row.slope;
  }
}

double Chebyshev::R(double z) const {
  double before = 1, now = 1 + stage[1].slope * z;
  for (std::size_t j = 2; j < stage.size(); ++j) {
    const Stage& row = stage[j];
    const double next =
        1 - row.mu - row.nu + row.mu * now + row.nu * before + z * (row.slope * now + row.first_slope);
    before = now;
    now = next;
  }
  return now;
}

double Chebyshev::stability_limit(int s) {
  return 2.0 / 3 * (static_cast<double>(s) * s - 1) * (1 - 2 * damping / 15);
}

int Chebyshev::stages_for(double z) {
  int s = std::max(2, static_cast<int>(std::sqrt(1 + 1.5 * z / (1 - 2 * damping / 15))));
  while (stability_limit(s) < z) ++s;
  return s;
}

}  // namespace pendula::integrate
