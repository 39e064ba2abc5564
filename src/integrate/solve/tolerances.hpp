// How large an error may be: |eᵢ| ≤ atolᵢ + rtolᵢ max(|yᵢ| before, |yᵢ| after).
#pragma once

#include <algorithm>
#include <cmath>

#include "base/math.hpp"

namespace pendula::integrate {

constexpr double default_rtol = 1e-6;  ///< where none is given

/// n + m entries each, in the order x, z.
struct Tolerances {
  Vec rtol, atol;
  Vec time = {};  ///< of n + m entries: within which an unknown of index 2 moves x by its size; empty: 1

  static Tolerances uniform(int size, double rtol, double atol) {
    return {Vec::Constant(size, rtol), Vec::Constant(size, atol)};
  }
  /// The factor, at least 1, on the tolerance of unknown k in a step of dt: x, known to its tolerance, leaves
  /// time/dt times that open for each index above 1 (docs/derivations.md, radau). Requires 0 <= k < n + m.
  double relaxation(int k, int index, double dt) const {
    const double part = std::min(1.0, time.size() == 0 ? dt : dt / time[k]);
    double factor = 1;
    for (int level = 1; level < index; ++level) factor /= part;
    return factor;
  }
};

/// The size of an error in units of the tolerance, component by component.
///
/// The root mean square, but never below a third of the largest component: as if at most nine components
/// shared one error. Systems of up to nine unknowns see the plain root mean square of the literature; in a
/// large quiet system the few active components are not averaged away (a mean over 10⁴ unknowns would
/// tolerate 100 times the error).
class ErrorSum {
 public:
  void add(double scaled) {
    const double square = scaled * scaled;
    sum_ += square;
    largest_ = square > largest_ ? square : largest_;
  }
  /// NaN if any component was NaN.
  double norm(int count) const { return norm(sum_, largest_, count); }
  /// From the sum and the largest of the squares.
  static double norm(double sum, double largest, int count) {
    const double mean = sum / std::max(count, 1), floor = largest * (1.0 / 9);
    return std::sqrt(mean > floor || mean != mean ? mean : floor);
  }

 private:
  double sum_ = 0, largest_ = 0;
};

/// x^(1/n), x ≥ 0, to seven digits: step size formulas.
double root(double x, int n);

}  // namespace pendula::integrate
