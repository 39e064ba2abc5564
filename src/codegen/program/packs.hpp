// Equal operations of neighbouring equations, four at a time (superword parallelism;
// Larsen & Amarasinghe, PLDI 2000).
//
//   f₁ = (x₁ - x₅)·r₁₅ + …     four equations of one shape become one of wide values: x₁ … x₄ is a load,
//   f₂ = (x₂ - x₅)·r₂₅ + …     x₅ is broadcast, and one root and one division serve four pairs of bodies.
//   f₃ = (x₃ - x₅)·r₃₅ + …     Values that are not side by side are gathered, number by number.
//   f₄ = (x₄ - x₅)·r₄₅ + …
#pragma once

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// The same program with wide instructions where they save a good part of the work; the program itself
/// where they do not. Every number keeps its bits: nothing is added up in another order. Only for
/// Machine with one lane. Cost: linear.
Program packed(const Program& program);
/// The longest programs that packed() looks at: it takes about 0.2 µs per instruction.
constexpr std::size_t longest_packed = 40'000;
/// About the cycles that a program takes as machine code, calls aside.
double cycles(const Program& program);

}  // namespace pendula::codegen
