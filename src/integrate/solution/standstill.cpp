#include "integrate/solution/standstill.hpp"

#include <algorithm>
#include <cmath>

#include "expr/graph/graph.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/error_sizes.hpp"

namespace pendula::integrate {
namespace {

/// The largest entry of v, in tolerances of the given values.
double size_of(const Vec& v, const Vec& values, const Tolerances& tolerances) {
  return largest_share(static_cast<int>(v.size()), v.data(), values.data(), tolerances.atol.data(),
                       tolerances.rtol.data());
}

}  // namespace

Standstill::Standstill(const Problem& problem, const Tolerances& tolerances, const std::vector<Event>& events)
    : autonomous_(!contains_time(problem)), tolerances_(tolerances), largest_(Vec::Zero(problem.n())) {
  std::vector<Expr> all;
  for (const Event& event : events) all.push_back(event.when);
  for (Expr leaf : leaves(all)) autonomous_ = autonomous_ && leaf != time_symbol();
}

void Standstill::after(const Point& point, double left) {
  if (!autonomous_) return;
  largest_ = largest_.cwiseMax(point.x.cwiseAbs());
  const double speed = size_of(point.xdot, point.x, tolerances_);
  if (speed * left >= slowest_.distance) return;
  rest_ = rest(point);
  slowest_.distance = speed * left;
  slowest_.t = point.t;
  slowest_.x = point.x;
}

std::optional<double> Standstill::rest(const Point& end) const {
  constexpr double visible = 10;        // tolerances, at the end
  constexpr double accelerated = 1000;  // times the distance at constant speed
  if (rest_ || slowest_.x.size() == 0) return rest_;
  const Vec moved = end.x - slowest_.x;
  const bool left = size_of(moved, slowest_.x, tolerances_) > accelerated * slowest_.distance;
  return left && size_of(moved, largest_, tolerances_) > visible ? std::optional(slowest_.t) : std::nullopt;
}

}  // namespace pendula::integrate
