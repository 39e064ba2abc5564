// Equations of a solution that slides along borders of piecewise equations.
//
// Where the vector fields on both sides of a border s = 0 point to it, no solution in the ordinary sense goes
// on. Filippov's solution stays on the border, with the combination of both sides that is tangent to it:
//
//   x′ = (1 - μ) f₊ + μ f₋,   0 = s′,   μ ∈ [0, 1]
//
// of an implicit model the same combination of its residuals. μ is eliminated, so that the unknowns remain
// those of the model: from s′ = 0 with f₊ and f₋, and z′ from 0 = g, written into it where the model is
// semi-explicit (from s″ = 0 where s′ does not jump on the border, as of √|s| sign(s)), else from one
// residual, whose place s′ = 0 takes. The solution leaves the border where μ leaves [0, 1].
//
// see  Filippov, Differential Equations with Discontinuous Righthand Sides, 1988, §4;
//      docs/derivations.md#sliding
#pragma once

#include <unordered_map>
#include <vector>

#include "dae/model/first_order.hpp"

namespace pendula::integrate {

struct SlidingForm {
  dae::FirstOrder form;
  std::vector<Expr> weights;     ///< μ of each border, in leaves of the form
  std::vector<Expr> conditions;  ///< 0 = s, in t and x: what the solution is moved back onto
};

/// One more border along which the solution slides. above, below: its modes on the two sides; has_root: of s,
/// so that it has to be written into the equations; at: values of all leaves of the form. False where no
/// combination of both sides stays on the border.
bool slide_along(SlidingForm& sliding, Expr border, const Substitution& above, const Substitution& below,
                 bool has_root, const std::unordered_map<Expr, double>& at);

}  // namespace pendula::integrate
