// Aliases and trivial equations: unknowns that the equations define are written into the others.
//
// Models from parts consist of trivial equations for the most part, v1 = v2, i1 + i2 = 0. Where
// a row is linear in an unknown with a factor that is zero nowhere, the unknown is replaced by what the row
// says. eliminate.hpp (here): the models before and after. elimination.hpp: rows and unknowns while it runs;
// occurrences.hpp: where unknowns occur; affine_row.hpp: residuals as sums; pivot.hpp: factors that may
// divide; written_sum.hpp: sums as one would write them.
#pragma once

#include <span>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// The same model without the unknowns that an equation defines.
///
/// An equation 0 = c·x + e with a constant c ≠ 0 (a number, or a product of parameters that is not 0 at their
/// values) defines x = -e/c. It is written into the other equations where they do not grow by more than a few
/// terms: always for x = const, x = ±y, x = c·y; for sums and for nonlinear e as a pivot of least fill-in
/// (Markowitz, Management Science 3(3), 1957). A differentiated x is eliminated, with the derivatives
/// of its definition, where these do not bring in more derivatives than go with x; the solutions are the
/// same: an equation between two states disappears this way, positions of rigid bodies follow from the
/// coordinates of their joints, and the index falls with it.
///
/// zeros    parameters that become the number 0 before: what they multiply is gone, the index is that of the
///          rest, and nothing divides by them
/// returns  a child of the model: relations hold what every eliminated unknown means in the others, the
///          trace says so line by line; the model itself where nothing is to be eliminated
/// throws   Error where equations contradict each other or say nothing new, naming one of them
/// cost     n log n for n unknowns in networks whose parts have few terms
ModelPtr eliminate(const ModelPtr& model, std::span<const Expr> zeros = {});

}  // namespace pendula::dae
