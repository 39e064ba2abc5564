// Jumps of functions that are known by their values alone: if t > 1 then … in an input written in Lua.
#pragma once

#include <functional>
#include <optional>

namespace pendula::integrate {

/// The first time in (from, to] at which f has another value than just before, to rounding. Looked at in
/// eighths: those in which f changes much more than in the others are bisected; a change that does not shrink
/// with the interval is a jump. Jumps that come in pairs within an eighth may be missed. Cost: 9 evaluations
/// where f is constant, some 20 to 60 where it is smooth.
std::optional<double> find_jump(const std::function<double(double)>& f, double from, double to);

}  // namespace pendula::integrate
