// Properties of operations for rewriting and code generation, beside those in graph.hpp.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

enum class Parity : std::uint8_t { none, odd, even };
/// How code generators make the operation: see ops.def.
enum class CodeKind : std::uint8_t { direct, sleef, each };
/// The one rational operand for which the value of a function is rational too.
struct ExactPoint {
  long x, y;
};

// Of an operation of the table.
Parity parity(Op op);
CodeKind code_kind(Op op);
std::optional<ExactPoint> exact_point(Op op);
/// The derivative by operand i = 0, 1, 2 in double arithmetic.
double apply_slope(Op op, int i, double a, double b, double c);

}  // namespace pendula
