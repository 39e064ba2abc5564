// BDF methods with a fixed step, for F(t, x, x′, z) = 0 of every kind.
#pragma once

#include "integrate/run/fixed_step_run.hpp"

namespace pendula::integrate {

/// Each step solves F(tₖ₊₁, xₖ₊₁, Σᵢ αᵢxₖ₊₁₋ᵢ/(β₀Δt), zₖ₊₁) = 0 to rounding. The first k - 1 points are made
/// by Radau IIA with s stages, 2s - 1 ≥ k, over the same mesh, so that they do not spoil the order; between
/// mesh points the polynomial through k + 1 of them is the solution. Brenan, Campbell & Petzold, Numerical
/// Solution of IVPs in DAEs, 1996, §3.2: order k also for index 2 and semi-explicit index 3, after the first
/// k steps.
///
/// Throws, returns   as integrate() of fixed_step_run.hpp
SolutionPtr integrate_bdf(ProblemPtr problem, MultistepPtr method, Point start, const Plan& plan);

}  // namespace pendula::integrate
