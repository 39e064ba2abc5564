// Newton's iteration with the exponents of exp, sinh, cosh and cᵘ as unknowns of their own.
//
// From above, Newton's iteration comes down an exponential by 1 in the exponent a step, and from below the
// tangent leads beyond the largest number: w = Is (exp((U - R w)/V) - 1), a diode behind a resistor, from
// w = 0 at U = 5. With s = (U - R w)/V as an unknown, the tangent is taken in s, and cut there: where exp(s)
// counts, a step up moves exp(s) as the tangent says, not s. docs/derivations.md#start.
#pragma once

#include <optional>
#include <span>

#include "base/math.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {

class LiftedNewton {
 public:
  /// `equations` in `unknowns` and `given` leaves; there may be more or fewer of them than unknowns.
  /// Throws Error naming a leaf that is neither. Cost: the derivatives of the equations.
  LiftedNewton(std::span<const Expr> equations, std::span<const Expr> unknowns, std::span<const Expr> given);

  /// Some exponent depends on the unknowns; otherwise there is nothing to lift.
  bool applies() const { return !both_ways_.empty(); }

  /// Where the steps have become small, from w, whose parts are measured in `unit`: a point for another
  /// iteration to begin with, not a proven solution. Nothing where an equation is not defined on the way, or
  /// after 200 steps. Source: lifted unknowns, Albersmeyer & Diehl, SIAM J. Optim. 20(3), 2010, §2; cut
  /// steps, Nagel, SPICE2: A Computer Program to Simulate Semiconductor Circuits, UCB/ERL M520, 1975.
  /// Requires applies(); w and unit by unknown, `given` by given leaf.
  std::optional<Vec> operator()(const Vec& w, std::span<const double> given, const Vec& unit) const;

 private:
  void compile(std::vector<Expr> rows, std::vector<Expr> leaves, std::size_t unknowns);
  Vec first_exponents(const Vec& w, std::span<const double> given) const;

  std::vector<char> both_ways_;  ///< by exponent: its function grows without end as it falls, too
  std::vector<Entry> jacobian_;
  std::optional<Evaluator> values_, slopes_;  ///< in unknowns, exponents, given
  std::optional<Evaluator> exponents_;        ///< in unknowns, given
};

}  // namespace pendula::dae
