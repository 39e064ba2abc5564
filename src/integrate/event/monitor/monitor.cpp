#include "integrate/event/monitor/monitor.hpp"

#include <cmath>
#include <limits>

namespace pendula::integrate {

void hermite(const Point& from, const Point& to, double share, Point& out) {
  const double s = share, dt = to.t - from.t;
  out.t = from.t + s * dt;
  out.xdot = (1 - s) * from.xdot + s * to.xdot;
  out.z = (1 - s) * from.z + s * to.z;
  out.x = (1 - s) * from.x + s * to.x +
          s * (s - 1) * ((1 - 2 * s) * (to.x - from.x) + dt * ((s - 1) * from.xdot + s * to.xdot));
}

Point a_moment_after(const Point& point) {
  const double moment = 16 * std::numeric_limits<double>::epsilon() * std::fabs(point.t);
  Point after = point;
  after.t += moment;
  after.x += moment * point.xdot;
  return after;
}

}  // namespace pendula::integrate
