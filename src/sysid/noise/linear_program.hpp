// Linear programs with few variables and many constraints, by the dual simplex method on the set of active
// constraints: start at a vertex of a huge box that is optimal for the cost, add the most violated
// constraint, drop the one that keeps the multipliers nonnegative (Chvátal, Linear Programming, §§10, 16).
// Every iteration solves with the n×n active matrix afresh, so that rounding does not build up.
#pragma once

#include <vector>

#include "base/math.hpp"

namespace pendula::sysid {

using Eigen::Index;

/// min cᵀx subject to G x ≤ h.
struct LinearProgram {
  Vec c;
  Mat G;
  Vec h;
};

struct LinearSolution {
  enum class Status { optimal, infeasible, unbounded } status = Status::optimal;
  Vec x;
  double value = 0;
  std::vector<Index>
      active;       ///< rows of G that meet at x, n of them; beyond G's rows: of a huge box, multiplier 0
  Vec multipliers;  ///< of the active rows, ≥ 0: c = -Gᵀλ
};
/// Cost per iteration: rows·n + n³. Throws Failure when it does not end.
LinearSolution solve(const LinearProgram& lp);

/// min Σ w(e_t) with w(e) = up·e for e ≥ 0 and -down·e for e < 0, e = y - Φθ: least absolute deviations
/// (Bloomfield & Steiger, Least Absolute Deviations, 1983): from vertex to vertex along the steepest edge,
/// with an exact line search by weighted medians. Requires full column rank. Returns θ.
Vec least_absolute(const Mat& Phi, const Vec& y, double up, double down);

}  // namespace pendula::sysid
