#include "lab/observed_order.hpp"

#include <cmath>

namespace pendula::lab {
namespace {

/// The slope of log e₊ over log e for the last pairs of errors in the phase of steady contraction. In ‖e₊‖ =
/// c ‖e‖^p, c depends on the direction of e; more pairs average that out.
double fitted(const std::vector<double>& error, std::size_t end) {
  constexpr std::size_t most = 4;  // a choice: earlier pairs may be far from the solution
  std::size_t begin = end;
  while (begin > 0 && end - begin < most && error[begin] < contracting * error[begin - 1]) --begin;
  const auto pairs = static_cast<double>(end - begin);
  if (pairs < 2) return 0;
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const double u = std::log(error[k]), v = std::log(error[k + 1]);
    x += u / pairs;
    y += v / pairs;
    xx += u * u / pairs;
    xy += u * v / pairs;
  }
  return (xy - x * y) / (xx - x * x);
}

}  // namespace

double Observed::ratio(std::size_t k, int p) const {
  if (k == 0 || k >= error.size() || !(error[k] > above_noise * noise)) return 0;
  return error[k] / std::pow(error[k - 1], p);
}

double Observed::order_at(std::size_t k) const {
  if (k < 2 || ratio(k, 1) == 0 || ratio(k - 1, 1) == 0) return 0;
  if (!(error[k] < contracting * error[k - 1] && error[k - 1] < contracting * error[k - 2])) return 0;
  return std::log(error[k] / error[k - 1]) / std::log(error[k - 1] / error[k - 2]);
}

Observed observe(const std::vector<Vec>& x, const Vec& root, double noise, bool linear) {
  Observed o;
  o.noise = noise;
  for (const Vec& v : x) o.error.push_back((v - root).norm());
  std::size_t end = 0;
  for (std::size_t k = 1; k < x.size(); ++k)
    if (o.ratio(k, 1) > 0) end = k;
  if (end == 0) return o;
  o.order = fitted(o.error, end);
  if (o.order == 0 && linear && end >= 2 && o.error[end] < o.error[end - 1])
    o.order = 1;  // too slow for a meaningful quotient of logarithms
  o.rate = o.ratio(end, linear ? 1 : 2);
  return o;
}

}  // namespace pendula::lab
