#include "integrate/tolerances.hpp"

#include <cmath>

namespace pendula::integrate {

double ErrorSum::norm(double sum, double largest, int count) {
  const double mean = sum / count;
  return std::sqrt(mean > largest / 9 ? mean : mean != mean ? mean : largest / 9);
}

}  // namespace pendula::integrate
