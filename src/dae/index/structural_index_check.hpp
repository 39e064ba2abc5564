// The structural index against the derivative array, at points of the solution.
#pragma once

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

/// The number of points at which both methods agree about the index ν of a regular analysis; 0 where they do
/// not, or no clear answer was found quickly (then derivative_array() has to decide). Looked at is F_k = 0
/// with k = ν - 1 alone: there the system Jacobian is regular, so that index and degrees of freedom are at
/// most the structural ones, and these free values exact (Pryce, BIT 41(2), 2001, Thm 4.2); x′ is not
/// determined, so that the index is not less (what F_k determines F_{k+1} determines too).
///
/// requires  analysis.regular
/// cost      dense ranks of order ν n; for ν = 0 and linear equations, whose ranks derivative_array() finds
///           exactly, 0 at once
int points_of_agreement(const Model& model, const Analysis& analysis);

/// The number of points (at most 3) of F_k = 0 at which x′ is not determined, so that the index is above k; 0
/// if x′ is determined at one of them, or where no answer was found. Of large models first parts are looked
/// at that are closed, equations in as many unknowns: the other equations, which determine the others, tell
/// nothing about these; then all equations for an open direction (open_direction.hpp). Cost: a dense rank of
/// order (k + 1) n at each, n up to 300; sparse solutions beyond.
int points_beyond(const Model& model, int k);

/// The number of points (at most 2) of F_k = 0 at which x′ is determined, so that the index is at most k
/// there. Sparse, for models of any size.
int points_determined(const Model& model, int k);

}  // namespace pendula::dae
