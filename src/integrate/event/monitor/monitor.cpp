#include "integrate/event/monitor/monitor.hpp"

#include <cmath>
#include <limits>

namespace pendula::integrate {

Point a_moment_after(const Point& point) {
  const double moment = 16 * std::numeric_limits<double>::epsilon() * std::fabs(point.t);
  Point after = point;
  after.t += moment;
  after.x += moment * point.xdot;
  return after;
}

}  // namespace pendula::integrate
