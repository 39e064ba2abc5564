// Loops of the tape over operands that lie in memory one after the other: what remains of an operation that a
// model repeats for every link of a chain or cell of a network.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// r[k] = op(a[k·stride[0]], b[k·stride[1]]), k < count; all numbers are slots of the workspace.
struct VectorLoop {
  Op op;
  Slot result, count;
  Slot operand[2];
  Slot stride[2];  ///< 0, 1, 2 or 4
};

/// Does the operation have a loop of its own, with vector instructions where the processor has them?
bool has_loop(Op op);
/// Where some members of a loop have their operands and results.
struct Places {
  const double *a, *b;
  double* r;
};
/// So many members of a loop. The values are those of ops.def
/// bit for bit. The result must not overlap the operands.
void run_members(const VectorLoop& loop, std::size_t count, const Places& places);

/// to[k·to_stride] = from[k·from_stride], k < count, with `from` and `to` moved by these slots.
struct Copy {
  Slot from, to, count;
  std::int32_t from_stride, to_stride;
};
/// Copies that bring number k from slot from[k] to k; none
/// reads slots on both sides of `inputs`. Cost: linear.
std::vector<Copy> arrange_copies(std::span<const Slot> from, Slot inputs);
void run_copy(const Copy& copy, const double* from, double* to);

/// Operands of the members of a run; b is 0 for operations with one operand.
struct Pair {
  Slot a, b;
};
/// An order of the members in which long stretches have operands
/// in arithmetic progression, and these stretches. Cost: linear.
struct Stretch {
  std::size_t first, count;  ///< positions in the order
  Slot stride[2];
};
struct Arrangement {
  std::vector<std::uint32_t> order;
  std::vector<Stretch> stretches;  ///< at the front of the order; what follows them has no pattern
};
Arrangement arrange(std::span<const Pair> members);

}  // namespace pendula::codegen
