// Ranks of matrices of expressions and of numbers; knows expressions only, no models.
//
// modular.hpp: generic rank without rounding, modulo a large prime. rank.hpp (here): generic rank of
// small matrices at random points, numeric rank, null space. rank_with_gap.hpp: numeric rank with the
// gap of singular values that decided it. rational_matrix.hpp and tracked_elimination.hpp: exact
// linear algebra over the rationals. definite.hpp: symmetric definite matrices. stable_values.hpp:
// values with cancellation recognised.
#pragma once

#include <numbers>

#include "base/math.hpp"
#include "dae/rank/modular.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::dae {

/// The fractional parts of its multiples 1, 2 … n divide [0, 1] most evenly for every n (Knuth, The Art of
/// Computer Programming 3, 1998, §6.4).
constexpr double golden_fraction = std::numbers::phi - 1;

/// Deterministic pseudo-random values in [0.5, 1.5] for every leaf and unspecified function the outputs
/// contain. The `attempt`-th draw; different attempts are independent.
std::unordered_map<Expr, double> random_point(std::span<const Expr> outputs, int attempt);

/// Largest rank over several random points. Rank deficiency at all of them means "identically
/// singular" up to a set of measure zero; points where an entry is not finite are skipped. Cost: a
/// few evaluations and one SVD each.
/// equations: where the entries come from; they tell the sizes of unknowns, of which the entries tell some.
int generic_rank(const MatX& m);
ModularRank generic_rank(std::span<const Entry> entries, int rows, int columns,
                         const std::vector<Expr>& equations = {});

/// Numeric rank by SVD after scaling rows and columns to unit size; `gap`, if given, receives σ_r / σ_1.
int numeric_rank(const Mat& m, double* gap = nullptr);

/// A basis of the null space of m, as columns (unit vectors).
Mat null_space(const Mat& m);

/// Values of all entries at a point. May contain NaN.
Mat evaluate(const MatX& m, const std::unordered_map<Expr, double>& values);

}  // namespace pendula::dae
