#include "integrate/tolerances.hpp"

#include <cmath>

namespace pendula::integrate {

double ErrorSum::norm(int count) const {
  const double mean = sum_ / count;
  return std::sqrt(mean > largest_ / 9 ? mean : mean != mean ? mean : largest_ / 9);
}

}  // namespace pendula::integrate
