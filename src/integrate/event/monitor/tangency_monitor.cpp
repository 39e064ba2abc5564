#include "integrate/event/monitor/tangency_monitor.hpp"

#include <cmath>

#include "expr/graph/derivative.hpp"

namespace pendula::integrate {

std::optional<TouchWatch::Hit> TouchWatch::after(const std::vector<double>& g, const Point& before,
                                                 const Tolerances& tolerances) {
  constexpr double near = 0.01;  // of the largest value so far: else no question
  constexpr double within = 10;  // tolerances: errors of steps add up
  std::optional<Hit> hit;
  const bool fresh = last_.size() != g.size();
  if (fresh) last_.assign(g.size(), {});
  for (std::size_t i = 0; i < g.size(); ++i) {
    if (events_[i].ends.empty()) continue;
    Seen& seen = last_[i];
    const double size = std::fabs(seen.last);
    const bool turned =
        !fresh && g[i] * seen.last > 0 && size <= std::fabs(seen.before) && size < std::fabs(g[i]);
    if (turned && !hit && size <= near * seen.largest && size <= within * uncertainty(i, before, tolerances))
      hit = Hit{static_cast<int>(i), size};
    seen.before = fresh ? 0 : seen.last, seen.last = g[i];
    seen.largest = std::max(seen.largest, std::fabs(g[i]));
  }
  return hit;
}

/// Σ |∂g/∂yⱼ| (atolⱼ + rtolⱼ |yⱼ|) over y = (x, z).
double TouchWatch::uncertainty(std::size_t which, const Point& point, const Tolerances& tolerances) {
  const auto& model = problem_->model();
  if (gradients_.empty()) gradients_.resize(events_.size());
  if (gradients_[which].outputs() == 0) {
    std::vector<Expr> unknowns = model.x;
    unknowns.insert(unknowns.end(), model.z.begin(), model.z.end());
    gradients_[which] = codegen::Kernel(gradient(events_[which].when, unknowns), problem_->arguments());
  }
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::vector<double> slopes(model.x.size() + model.z.size());
  gradients_[which](problem_->values().data(), slopes.data());
  double sum = 0;
  for (std::size_t j = 0; j < slopes.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    const double y = k < point.x.size() ? point.x[k] : point.z[k - point.x.size()];
    sum += std::fabs(slopes[j]) * (tolerances.atol[k] + tolerances.rtol[k] * std::fabs(y));
  }
  return sum;
}

}  // namespace pendula::integrate
