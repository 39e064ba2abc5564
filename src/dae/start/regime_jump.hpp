// The jump onto the conditions of a regime: x⁺ = x⁻ + Δx with impulses Λ of z, the least solution of
//
//   ∫ ∂F/∂x′ dx + ∂F/∂z Λ = 0,   0 = G(x⁻ + Δx)
//
// see  docs/derivations.md#regimes
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"
#include "dae/model/first_order.hpp"
#include "dae/start/continuations.hpp"
#include "dae/start/start.hpp"

namespace pendula::dae {

/// An expression at values; leaves without value (derivatives that nothing asked for) count as 0.
double value_at(Expr e, PointValues values);

constexpr double rounding_of_sums = 1e-14;  ///< of the largest term

/// What the rounding of leaves is measured by.
struct Sizes {
  PointValues of;
  double rate = 1;  ///< 1/time: of derivatives that have no size of their own

  double operator()(Expr leaf) const;
};

/// Σ |∂e/∂y| s over the leaves y of an expression, s their sizes.
double size_of(Expr e, const PointValues& values, const Sizes& sizes);

/// x⁺ - x⁻, and the impulses Λ of z and Δx of x′, with what their rounding is measured by.
struct Jump {
  Vec change;
  PointValues impulses, sizes;
  bool jumps = false;
};

/// From `before`, values of all leaves, onto 0 = G(x) = conditions. sizes: of states, what they have been
/// before. close: of the terms, where equations hold. ∂F/∂x′ is integrated on the way where it contains
/// what jumps and its rows are gradients (charges of nonlinear capacitors). Nothing where no impulse leads
/// there, or, with the reason in `why`, where factors change during the impulse in another way: the
/// equations then do not determine the jump.
std::optional<Jump> jump_onto(const std::vector<Expr>& conditions, const FirstOrder& form, PointValues before,
                              const LeafValues& sizes, double close, std::string& why);

}  // namespace pendula::dae
