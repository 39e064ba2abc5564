// The set {θ : lower ≤ Φθ ≤ upper}: what uniformly distributed noise leaves of the parameters.
//
// Vertices by double description (Motzkin et al., 1953; Fukuda & Prodon, LNCS 1120, 1996): begin with the box
// of d independent rows, cut with the most violated constraint, keep vertices with their neighbours. A
// constraint that no vertex violates is redundant for good. Bounds are relaxed by distinct amounts of
// relative size 1e-10 while the structure is found, so that every vertex lies on exactly d constraints; the
// vertices themselves are then solved from the true bounds, and exactly, in rational numbers, where the data
// are rational. docs/derivations.md#uniform-noise and #double-description.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gmpxx.h>

#include "base/math.hpp"

namespace pendula::sysid {

using Eigen::Index;

struct FeasibleSet {
  Mat Phi;
  Vec lower, upper;  ///< per row
};

/// The strips y - high ≤ Φθ ≤ y - low in rational numbers, if every number has a denominator up to 10⁶ and
/// the work is small.
struct ExactStrips {
  std::vector<std::vector<mpq_class>> Phi;
  std::vector<mpq_class> lower, upper;
};
std::optional<ExactStrips> exact_strips(const Mat& Phi, const Vec& y, double low, double high);

struct Polytope {
  Mat vertices;                               ///< one per row; counter-clockwise for d = 2, sorted otherwise
  std::vector<std::vector<Index>> active;     ///< of each vertex: 2·row + (1: upper, 0: lower)
  std::vector<std::vector<mpq_class>> exact;  ///< the same vertices, or empty
  bool empty() const { return vertices.rows() == 0; }
};

/// Requires full column rank (Error otherwise). Cost: about vertices·rows·d. Throws
/// Failure above 200000 vertices.
Polytope polytope(const FeasibleSet& s, const std::optional<ExactStrips>& exact = {});

/// By simple_volume() where it applies, else from the volumes of faces; throws
/// Failure where these are too many.
double volume(const FeasibleSet& s, const Polytope& p);
/// Where every vertex lies on exactly d constraints (else nothing, or where it is flat): in more
/// digits than doubles have, so that the result is right to rounding of the data. Cost: d³
/// operations of 256 bits for each vertex.
/// see    Lawrence, Math. Comp. 57, 1991
std::optional<double> simple_volume(const FeasibleSet& s, const Polytope& p);
/// The same in rational numbers. Requires exact vertices.
mpq_class exact_volume(const Polytope& p);

struct Ball {
  Vec center;
  double radius = 0;
};
/// The largest ball inside (Chebyshev centre), from the constraints active at some vertex.
Ball largest_ball(const FeasibleSet& s, const Polytope& p);

/// The smallest γ for which {|mid_t - φᵀθ| ≤ γ} is not empty, one θ that attains it,
/// and the rows that decide.
struct SmallestBound {
  double bound = 0;
  Vec theta;
  std::vector<Index> rows;
};
SmallestBound smallest_bound(const Mat& Phi, const Vec& mid);

/// [min θ_i, max θ_i]; infinite where unbounded. Linear programs: also for
/// rank-deficient Φ. Requires feasible.
Mat intervals(const FeasibleSet& s);

}  // namespace pendula::sysid
