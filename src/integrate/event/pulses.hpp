// Short pulses of functions of time in the equations, which a step could pass over.
//
// A step-size control sees the equations at a few points of each step. Where the right-hand side
// has been smooth, steps become long, and a Gaussian of a hundredth of their length may lie
// between those points: the run would finish without it. Expressions of t and parameters alone,
// and inputs, can be sampled before the run.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::integrate {

/// The maximal subexpressions of t and parameters that may have pulses.
std::vector<Expr> functions_of_time(std::span<const Expr> equations, const std::vector<Expr>& parameters);

/// Times inside [from, to], ascending, at which steps should end so that no pulse is passed over, eleven for
/// each pulse. A pulse is a change of one of the functions of time, there and back or once, within a
/// thirtieth of the interval, with rest before it (or the beginning of the run) and after it. Pulses longer
/// than some 1/2000 of the interval are found.
std::vector<double> pulse_times(const std::vector<Expr>& functions, const std::vector<Expr>& parameters,
                                std::span<const double> values, double from, double to);

/// The same for functions known by their values only, and also for slower changes: where nothing else moves,
/// steps may otherwise be as long as the run. Cost: 2049 evaluations of each.
std::vector<double> pulse_times(std::span<const std::function<double(double)>> inputs, double from,
                                double to);

}  // namespace pendula::integrate
