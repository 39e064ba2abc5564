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

}  // namespace pendula
