#include "method/stability.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.hpp"
#include "method/order_conditions.hpp"

namespace pendula::integrate {

// Decides positive semidefiniteness by symmetric elimination with the largest pivot; exact up to the digits
// of the coefficients.
bool is_algebraically_stable(const Tableau& rk) {
  const Coefficients& c = rk.coefficients();
  const int s = rk.stages();
  // entries b_i a_ij + b_j a_ji - b_i b_j and their elimination: a choice
  const double tolerance = 64 * c.unit;
  RealMatrix M(s, c.bits);
  for (int i = 0; i < s; ++i) {
    if (c.b[i] < -tolerance) return false;
    for (int j = 0; j < s; ++j) M(i, j) = c.b[i] * c.A(i, j) + c.b[j] * c.A(j, i) - c.b[i] * c.b[j];
  }
  std::vector<bool> done(static_cast<std::size_t>(s), false);
  for (int step = 0; step < s; ++step) {
    int k = -1;
    for (int i = 0; i < s; ++i) {
      if (done[i]) continue;
      if (M(i, i) < -tolerance) return false;
      if (k < 0 || M(i, i) > M(k, k)) k = i;
    }
    if (M(k, k) <= tolerance) {  // the rest must vanish
      for (int i = 0; i < s; ++i)
        for (int j = 0; j < s; ++j)
          if (!done[i] && !done[j] && abs(M(i, j)) > tolerance) return false;
      return true;
    }
    done[k] = true;
    for (int i = 0; i < s; ++i)
      for (int j = 0; j < s; ++j)
        if (!done[i] && !done[j]) M(i, j) -= M(i, k) * M(k, j) / M(k, k);
  }
  return true;
}

std::optional<DaeOrders> dae_orders(const Tableau& rk, const Stability& stability) {
  const Coefficients& c = rk.coefficients();
  const auto [B, C, D] = simplifying_assumptions(c, c.b);
  const int p = rk.order(), q = std::min(C, B), r = D;
  const double limit = stability.at_infinity();
  constexpr double rounding = 1e-12;  // of R(∞), a quotient of doubles: 4500 ε
  const bool stiff = rk.is_stiffly_accurate(), inside = std::fabs(limit) < 1 - rounding;
  const bool minus_one = std::fabs(limit + 1) <= rounding, one = std::fabs(limit - 1) <= rounding;
  const bool first_explicit = rk.starts_explicit();
  bool solvable = degree(stability.Q()) == rk.stages();  // det A ≠ 0
  if (first_explicit) solvable = stiff && !rk.is_explicit() && degree(stability.Q()) == rk.stages() - 1;
  if (!solvable) return {};
  DaeOrders orders;
  orders.x1 = p;
  orders.z1 = stiff ? p : inside || minus_one ? std::min(p, q + 1) : one ? std::min(p, q) : 0;
  if (!stiff && !inside && !minus_one && !one) return orders;
  if (stiff) {
    orders.x2 = std::min({p, 2 * q, q + r + 1});
    orders.z2 = one ? q - 1 : q;
  } else {
    orders.x2 = one ? std::min(p, q) : std::min(p, q + 1);
    if (!inside && q < 2 && rk.stages() > 1) orders.x2 = 0;  // z diverges, and so does x
    orders.z2 = inside ? q : minus_one ? q - 1 : std::max(0, q - 2);
  }
  if (rk.stages() == 1 && stiff) {  // implicit Euler is BDF 1: order 1 after two constant steps
    orders.x3 = orders.v3 = orders.z3 = 1;
  } else if (stiff && !first_explicit && q >= 2) {
    orders.x3 = std::min({p, 2 * q - 2, q + r});
    orders.v3 = q;
    orders.z3 = q - 1;
  } else {
    orders.x3 = orders.v3 = orders.z3 = 0;
  }
  return orders;
}

}  // namespace pendula::integrate
