// The order of an iteration, measured: ‖eₖ₊₁‖ ≈ c ‖eₖ‖^p.
#pragma once

#include <vector>

#include "base/math.hpp"

namespace pendula::lab {

/// An error is measured while it is this many times its noise, so that four digits
/// of a ratio are not rounding.
inline constexpr double above_noise = 1e4;

/// Errors contract steadily while each is below this part of the one before: a choice.
inline constexpr double contracting = 0.9;
/// A predicted rate above it is visible as linear convergence: three digits are won per step at most.
inline constexpr double visibly_linear = 1e-3;

struct Observed {
  std::vector<double> error;  ///< ‖xₖ - x⋆‖₂
  double noise = 0;           ///< what rounding leaves of it
  double order = 0;  ///< p, fitted to the last pairs (at most four) of steady contraction; 0: too few
  double rate = 0;  ///< the last ‖e₊‖/‖e‖ (linear) or ‖e₊‖/‖e‖² that is not rounding; 0: none

  /// ‖eₖ‖/‖eₖ₋₁‖^p, or 0 where one of them is rounding.
  double ratio(std::size_t k, int p) const;
  /// The order of three consecutive errors that ends at k, or 0.
  double order_at(std::size_t k) const;
};

/// `linear`: the theory predicts linear convergence; decides which ratio is the rate.
Observed observe(const std::vector<Vec>& x, const Vec& root, double noise, bool linear);

}  // namespace pendula::lab
