#include "integrate/solve/tolerances.hpp"

#include <cmath>

namespace pendula::integrate {

double root(double x, int n) {
  if (n == 4) return std::sqrt(std::sqrt(x));
  if (n == 8) return std::sqrt(std::sqrt(std::sqrt(x)));
  return std::pow(static_cast<float>(x), 1 / static_cast<float>(n));
}

}  // namespace pendula::integrate
