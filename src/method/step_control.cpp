#include "method/step_control.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace pendula::integrate {

/// |x₁ - g| / |z (x₁ - 1)| for x′ = z x, x(0) = 1, where g is a stage at the end of the step.
static double share_of_slope(const Tableau& rk, int g, std::complex<double> z) {
  const Mat& A = rk.A();
  std::vector<std::complex<double>> Y, K;
  std::complex<double> end = 1;
  for (int i = 0; i < rk.stages(); ++i) {
    std::complex<double> sum = 1;
    for (int j = 0; j < i; ++j) sum += A(i, j) * K[j];
    Y.push_back(sum);
    K.push_back(z * sum);
    end += rk.b()[i] * K.back();
  }
  return std::abs(end - Y[g]) / std::abs(z * (end - 1.0));
}

/// The stability limit on the negative axis, by marching and bisection on the stages of x′ = λx.
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
  constexpr double step = 0.1, rounding = 1e-9;  // |R| touches 1 inside the regions of some methods
  constexpr double most = 1000;                  // a cap; |R| of an explicit method grows like a power of y
  constexpr int halvings = 30;                   // of 0.1, to 10⁻¹⁰
  double y = step;
  while (R(-y) <= 1 + rounding && y < most) y += step;
  double low = y - step;
  for (int k = 0; k < halvings; ++k) (R(-(low + y) / 2) <= 1 ? low : y) = (low + y) / 2;
  return low;
}

StepRules::StepRules(const Tableau& rk) : stability_limit(negative_limit(rk)), fsal(rk.is_fsal()) {
  const int embedded = rk.data().embedded ? *rk.data().embedded : rk.embedded_order();
  control_order = rk.bhat2() ? rk.order() : std::min(rk.order(), embedded) + 1;
  // DOPRI5: β = 0.04 at order 5, exponent 0.2 - 0.75 β, factors 0.2 … 10. DOP853: β = 0, factors 1/3 … 6.
  beta = control_order < 7 ? 0.2 / control_order : 0;
  exponent = 1.0 / control_order - 0.75 * beta;
  slowest = control_order < 7 ? 0.2 : 1.0 / 3;
  fastest = control_order < 7 ? 10 : 6;
  settled_fastest = rk.bhat2() ? 3 : fastest;
  for (int i = rk.stages() - 1 - (fsal ? 1 : 0); i > 0 && !stiff_stage; --i)
    if (rk.c()[i] == 1) stiff_stage = i;
  // No method resolves more than half an oscillation per step; solutions of nonlinear equations reach up to
  // six times that ratio (van der Pol's equation at rtol = 10⁻³).
  constexpr double half_an_oscillation = 3, usual = 7;
  if (stiff_stage) resolution = usual * share_of_slope(rk, *stiff_stage, {0, half_an_oscillation});
}

}  // namespace pendula::integrate
