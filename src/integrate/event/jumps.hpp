// Jumps and kinks of functions that are known by their values alone: if t > 1 then …, or
// math.abs(t - 1), in an input written in Lua.
#pragma once

#include <functional>
#include <optional>

namespace pendula::integrate {

/// The first time in (from, to] at which f has another value than just before, to rounding; else the
/// first inside at which its slope jumps. Looked at in eighths, which are bisected where f, or its
/// second difference, changes much more than in the others: what does not shrink with the interval is a
/// jump; a second difference that shrinks like the interval, and not like its square, is a kink. Missed
/// may be jumps that come in pairs within an eighth, three kinks or more in [from, to], and those that
/// are less than f″ times half of it.
///
/// at_break  `to` is such a time itself, to rounding
/// size      the largest |f| so far; changes beyond its last digits are neither jump nor kink
/// cost      9 evaluations where f is constant, 25 where it is linear or well resolved, up to 100 else
std::optional<double> find_break(const std::function<double(double)>& f, double from, double to,
                                 bool at_break, double& size);

}  // namespace pendula::integrate
