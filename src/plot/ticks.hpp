// Where the numbers on an axis stand and how they are written: 1-2-5 steps,
// decades on log axes, a common power of ten or offset when the numbers
// would be unreadable. Both back ends use these, so both say the same.
#pragma once

#include <string>
#include <vector>

#include "plot/figure.hpp"

namespace pendula::plot {

struct Ticks {
  std::vector<double> at;         ///< increasing, all inside the range
  std::vector<std::string> text;  ///< one for each: "0.25", "10⁻³"
  std::vector<double> minor;      ///< unlabelled marks of a log axis
  std::string suffix;  ///< what the numbers must be combined with, for the axis label: "×10⁻⁸", "+ 9.81"
};

/// At most `count` ticks at multiples of 1, 2 or 5 times a power of ten, of at least `step_min`.
Ticks linear_ticks(Range range, int count, double step_min = 0);
/// At the multiples of a step that the figure asks for, or of a multiple of it where there would be too many.
Ticks ticks_of_step(Range range, int count, double step);

/// Decades (every k-th when there are many), 1-2-5 in each when there are few. Requires 0 < low < high.
Ticks log_ticks(Range range, int count);

/// The ticks of a figure's axis over `range`.
Ticks ticks(const Axis& axis, Range range, int count);

/// Position of a value on the axis: 0 at range.low, 1 at
/// range.high, log axes and reversed ones taken into account.
double fraction(const Axis& axis, Range range, double value);

/// "C₁ [m²]  ×10⁻⁸": the axis label with what its numbers must be combined with.
std::string labelled(const std::string& label, const Ticks& ticks);

}  // namespace pendula::plot
