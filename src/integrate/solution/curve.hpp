// A solution as it is drawn: points so dense that the polyline through them looks like the curve.
//
// The points an integrator saves are as far apart as its error allows, up to a turn of an oscillation: joined
// by straight lines they are a polygon. Here every piece between two saved points is divided, by the method's
// continuous extension, until the points in between lie on the chord to a fraction of a pixel. The line is
// interrupted where the solution jumps.
//
//   saved       o-----------------o---------------o|o----------o      |  a jump: two points of one time
//   curve       o--o--o-o-o-o--o--o---o--o--o--o--o o---o---o--o
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "integrate/solution/solution.hpp"

namespace pendula::integrate {

/// One coordinate of the sheet.
struct SheetAxis {
  double pixels = 500;
  bool log = false;
  std::optional<std::pair<double, double>> limits;  ///< chosen by the user; otherwise the data fills it
};

/// Curves over common times: each is a list of two or three columns of the values, drawn against the axes.
struct CurvePlan {
  std::vector<std::vector<int>> curves;
  std::vector<SheetAxis> axes;
  double tolerance = 0.2;     ///< pixels between curve and polyline
  std::size_t most = 20'000;  ///< evaluations of the continuous extension
};

struct CurvePoints {
  Mat values;                        ///< one row per point, one column per expression
  std::vector<Eigen::Index> breaks;  ///< rows before which the line is interrupted, ascending
  std::vector<Eigen::Index> saved;   ///< rows that the solution holds
};

/// requires  expressions that the solution knows; columns named in plan.curves exist
/// returns   the saved points and as many between them as the plan asks for; where the continuous extension
///           fails or is not kept, and beyond plan.most, the saved points alone
CurvePoints curve_points(const Solution& solution, std::span<const Expr> expressions, const CurvePlan& plan);

}  // namespace pendula::integrate
