#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

void hermite(const Point& from, const Point& to, double share, Point& out) {
  const double h = to.t - from.t, u = share, v = 1 - u;
  const double a = v * v * (1 + 2 * u), b = u * u * (3 - 2 * u), c = h * u * v * v, d = -h * u * u * v;
  const double da = 6 * u * v / h, dc = v * (1 - 3 * u), dd = u * (3 * u - 2);
  out.t = from.t + u * h;
  out.x = a * from.x + b * to.x + c * from.xdot + d * to.xdot;
  out.xdot = da * (to.x - from.x) + dc * from.xdot + dd * to.xdot;
  out.z = v * from.z + u * to.z;
}

}  // namespace pendula::integrate
