// The drivers for steps of a fixed length: tableaus (fixed_step_run.cpp), BDF for F(t, x, x′, z) = 0
// of every kind (fixed_bdf.cpp).
#pragma once

#include "integrate/plan/plan.hpp"
#include "integrate/solution/solution.hpp"
#include "integrate/step/runge_kutta.hpp"

namespace pendula::integrate {

/// Of a step: (to - from)/dt errs by ε of the number of steps, below 10⁶ in most runs; a step as short is
/// not taken.
constexpr double dt_rounding = 1e-9;

/// Steps tₖ = from + k dt; the last one is shortened to end at `to`. start: x is taken as it is, x′ and z are
/// starting values of Newton's method (start.t is ignored). Requires plan.dt.
///
/// returns   the solution; when a step fails, a value is not finite or Ctrl-C is pressed, the part computed
///           so far, and its outcome says why
/// throws    Error on a bad plan (dt ≤ 0, to ≤ from, times); Failure when the start determines no x′ and z
///           (index above 1) or Newton finds none; what an input function throws
/// cost      per step of an s-stage fully implicit method: O((s(n + m))³) per Newton iteration
SolutionPtr integrate(ProblemPtr problem, TableauPtr tableau, Point start, const Plan& plan);

/// Each step solves F(tₖ₊₁, xₖ₊₁, Σᵢ αᵢxₖ₊₁₋ᵢ/(β₀Δt), zₖ₊₁) = 0 to rounding. The first k - 1 points are
/// made by Radau IIA with s stages, 2s - 1 ≥ k, over the same mesh, so that they do not spoil the
/// order; between mesh points the polynomial through k + 1 of them is the solution. Brenan, Campbell &
/// Petzold, Numerical Solution of IVPs in DAEs, 1996, §3.2: order k also for index 2 and semi-explicit
/// index 3, after the first k steps.
///
/// Throws, returns   as integrate()
SolutionPtr integrate_bdf(ProblemPtr problem, MultistepPtr method, Point start, const Plan& plan);

}  // namespace pendula::integrate
