#include "method/step_control.hpp"

#include <algorithm>
#include <cmath>

namespace pendula::integrate {

/// By marching and bisection on the stages of x′ = λx.
static double negative_limit(const Tableau& rk) {
  const Mat& A = rk.A();
  const auto R = [&](double z) {
    Vec K(rk.stages());
    for (int i = 0; i < K.size(); ++i) {
      double sum = 1;
      for (int j = 0; j < i; ++j) sum += z * A(i, j) * K[j];
      K[i] = sum;
    }
    return std::fabs(1 + z * rk.b().dot(K));
  };
  double y = 0.1;
  while (R(-y) <= 1 + 1e-9 && y < 1000) y += 0.1;
  double low = y - 0.1;
  for (int k = 0; k < 30; ++k) (R(-(low + y) / 2) <= 1 ? low : y) = (low + y) / 2;
  return low;
}

StepRules::StepRules(const Tableau& rk) : stability_limit(negative_limit(rk)), fsal(rk.is_fsal()) {
  const int embedded = rk.data().embedded ? *rk.data().embedded : rk.embedded_order();
  control_order = rk.bhat2() ? rk.order() : std::min(rk.order(), embedded) + 1;
  beta = control_order < 7 ? 0.2 / control_order : 0;
  exponent = 1.0 / control_order - 0.75 * beta;
  slowest = control_order < 7 ? 0.2 : 1.0 / 3;
  fastest = control_order < 7 ? 10 : 6;
  for (int i = rk.stages() - 1 - (fsal ? 1 : 0); i > 0 && stiff_stage < 0; --i)
    if (rk.c()[i] == 1) stiff_stage = i;
}

}  // namespace pendula::integrate
