#include "lti/curve_facts.hpp"

#include <algorithm>
#include <cmath>

#include "lti/matrices.hpp"

namespace pendula::lti {
namespace {

/// The first time at which the interpolated curve reaches `level`.
std::optional<double> crossing(const Vec& t, const Vec& y, double level) {
  for (Index k = 0; k < t.size(); ++k) {
    if (y[k] >= level && k == 0) return t[0];
    if (y[k] >= level) return t[k - 1] + (t[k] - t[k - 1]) * (level - y[k - 1]) / (y[k] - y[k - 1]);
  }
  return {};
}

}  // namespace

CurveFacts curve_facts(const Vec& t, const Vec& y, double final) {
  CurveFacts f;
  f.final = final;
  Index at = 0;
  const double sign = final < 0 ? -1 : 1;
  (sign * y).maxCoeff(&at);
  f.peak = y[at];
  f.peak_time = t[at];
  // in the unit of y: a choice; facts relative to a final value of 0 say nothing
  constexpr double zero = 1e-12;
  if (std::fabs(final) < zero) return f;
  const Vec scaled_y = y / final;
  constexpr double rise_from = 0.1, rise_to = 0.9, settled = 0.02;  // by definition
  const auto low = crossing(t, scaled_y, rise_from), high = crossing(t, scaled_y, rise_to);
  if (low && high) f.rise_time = *high - *low;
  f.overshoot = std::max(0.0, 100 * (scaled_y[at] - 1));
  constexpr double none = 1e-7;  // percent: the response is known to ten digits or so
  if (*f.overshoot < none) f.overshoot = 0;
  for (Index k = t.size(); k-- > 0;)
    if (std::fabs(scaled_y[k] - 1) > settled) {
      if (k + 1 < t.size()) {
        const double a = std::fabs(scaled_y[k] - 1), b = std::fabs(scaled_y[k + 1] - 1);
        f.settling_time = t[k] + (t[k + 1] - t[k]) * (a > b ? (a - settled) / (a - b) : 1);
      }
      break;
    }
  if (!f.settling_time && std::fabs(scaled_y[0] - 1) <= settled) f.settling_time = t[0];
  return f;
}

}  // namespace pendula::lti
