// What follows from the conditions of events and the equations alone, not from numbers.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Of every condition g, in their order.
struct EventConditions {
  struct Condition {
    Expr when;
    bool guard;  ///< where it is 0, the equations become singular: x′ and z must not be asked for
  };
  /// Remembered for runs of the same equations.
  static std::shared_ptr<const EventConditions> of(const Problem& problem, std::span<const Condition> list);

  codegen::Kernel kernel;         ///< g, then dg/dt, the slopes of the arguments of sines, narrow, its slopes
  std::vector<char> slope_known;  ///< dg/dt contains nothing but known leaves
  std::vector<char> measured;     ///< its slope is a difference along the step
  std::vector<char> clock;        ///< g depends on time alone
  /// g is not a polynomial of t, x and their sines and cosines: like 1 - 2 exp(-100 x²) it may touch 0
  /// between two samples of a step in which the solution is smooth.
  std::vector<char> may_dip;
  std::vector<std::size_t> phases;  ///< the condition of each of those arguments
  /// The condition of each part u that makes g narrow where u turns: exponents, divisors, what is under a
  /// root, squares of what a tanh or |…| contains.
  std::vector<std::size_t> narrow;
  std::vector<char> is_exponent;  ///< of each: a change by 1 counts, of the others one relative to u
  bool needs_derivatives = false;
};

}  // namespace pendula::integrate
