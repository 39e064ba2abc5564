#include "integrate/step/pulse_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

void PulseWatch::Range::include(double value) {
  low = std::min(low, value);
  high = std::max(high, value);
}

PulseWatch::PulseWatch(int n, int m)
    : n_(n),
      ranges_(static_cast<std::size_t>(m)),
      in_step_(ranges_),
      missed_(n),
      y_(static_cast<std::size_t>(n + m)),
      slope_(static_cast<std::size_t>(n)) {}

void PulseWatch::start(const Vec& z) {
  for (std::size_t k = 0; k < ranges_.size(); ++k) ranges_[k] = {z[k], z[k]};
}

void PulseWatch::begin(const Vec& z, const Vec& z_end) {
  for (std::size_t k = 0; k < in_step_.size(); ++k) in_step_[k] = {z[k], z[k]};
  include(z_end.data());
}

void PulseWatch::include(const double* z) {
  for (std::size_t k = 0; k < in_step_.size(); ++k) in_step_[k].include(z[k]);
}

bool PulseWatch::is_due(const std::vector<double>& scale) const {
  constexpr double quarter = 0.25, visible = 100;  // of the range; tolerances
  for (std::size_t k = 0; k < in_step_.size(); ++k) {
    if (ranges_[k].width() == 0 && in_step_[k].width() > visible * scale[n_ + k]) return true;
    const double again =
        std::min(in_step_[k].high, ranges_[k].high) - std::max(in_step_[k].low, ranges_[k].low);
    if (again > std::max(quarter * ranges_[k].width(), visible * scale[n_ + k])) return true;
  }
  return false;
}

double PulseWatch::distance_from_equations(const Step& step, const Equations& equations) {
  constexpr double share = 0.1, part = 1e-3, visible = 100;
  constexpr double unknown = 2;  // no solution of the equations there; requests a somewhat shorter step
  Vec xdot(n_), z(static_cast<Eigen::Index>(in_step_.size()));
  missed_.setZero();
  double begin = 0, worst = 0;
  for (const double node : step.nodes) {
    const double width = (node - begin) / (step.samples + 1);
    for (int i = 1; i <= step.samples; ++i) {
      const double at = begin + width * i;
      step.curve(at, y_.data(), slope_.data());
      xdot = Eigen::Map<const Vec>(slope_.data(), n_);
      z = Eigen::Map<const Vec>(y_.data() + n_, z.size());
      if (!equations(step.t + at * step.dt, y_.data(), xdot, z)) return unknown;
      const double simpson = (i % 2 == 1 ? 4 : 2) * width / 3;  // the error is 0 at the nodes
      missed_ += simpson * (xdot - Eigen::Map<const Vec>(slope_.data(), n_));
      for (std::size_t k = 0; k < in_step_.size(); ++k) {
        const double size = std::max(std::fabs(in_step_[k].low), std::fabs(in_step_[k].high));
        const double unit = share * in_step_[k].width() + part * size + visible * step.scale[n_ + k];
        worst = std::max(worst, std::fabs(z[k] - y_[n_ + k]) / unit);
      }
    }
    begin = node;
  }
  return worst;
}

double PulseWatch::missed_norm(double dt, const std::vector<double>& scale,
                               const std::function<bool(const Vec&, std::vector<double>&)>& filter) {
  const auto norm = [&](double factor, const double* v) {
    ErrorSum sum;
    for (int k = 0; k < n_; ++k) sum.add(factor * v[k] / scale[k]);
    return sum.norm(static_cast<int>(y_.size()));
  };
  if (norm(dt, missed_.data()) < 1 || !filter(missed_, y_)) return 0;
  const double filtered = norm(1, y_.data());
  return std::isfinite(filtered) ? filtered : std::numeric_limits<double>::max();
}

void PulseWatch::accept() {
  for (std::size_t k = 0; k < ranges_.size(); ++k) {
    ranges_[k].include(in_step_[k].low);
    ranges_[k].include(in_step_[k].high);
  }
}

}  // namespace pendula::integrate
