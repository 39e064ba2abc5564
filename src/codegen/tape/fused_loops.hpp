// Loops over the same range become one loop (fusion; Allen &
// Kennedy, Optimizing Compilers for Modern Architectures, §6.2).
//
// A loop per operation reads and writes whole arrays; of a large model they lie in the second-level cache or
// behind it, and moving them takes longer than computing. Fused loops run chunk by chunk: all operations on
// some hundred members, then on the next ones. A result that only the same loop reads, at the member where it
// was made, lives in a buffer for one chunk. What reads another member, such as the next link of a chain,
// runs as many steps later (its shift).
#pragma once

#include <vector>

#include "codegen/tape/vector_loops.hpp"

namespace pendula::codegen {

/// A loop as part of a loop: its member j runs in step j + shift. Local numbers are slots of buffers, in
/// which step k of a chunk has place k.
struct FusedOperation {
  VectorLoop loop;
  Slot shift = 0;
  bool local_result = false, local_operand[2] = {false, false};
};

struct FusedLoop {
  std::vector<FusedOperation> operations;
  Slot steps = 0, chunk = 0;
};

/// Inputs are read from `in`, operands that are results from `workspace`.
void run_loop(const FusedLoop& loop, Slot inputs, const double* in, double* workspace);

/// The items of a tape, in an order that respects dependences; every result has a range of slots of its own.
struct Item {
  bool is_loop = false;
  VectorLoop loop{};  ///< if it is one; else an operation without pattern or a linear system
  Slot result = 0, size = 0;
  std::vector<Slot> reads;  ///< of the others
};

/// When items run: at even times those without pattern, in the given order; at odd times loops.
struct Timing {
  std::vector<Slot> time;
  std::vector<Slot> loop;   ///< of pieces: number of their loop
  std::vector<Slot> shift;  ///< in it
  std::vector<char> local;  ///< pieces whose results nobody reads outside of their chunk
  Slot loops = 0;
};
constexpr Slot no_owner = 0xffff'ffffu;
/// owner: the item that makes a slot, or no_owner; kept: slots that are read when all is done. Cost: linear.
Timing fuse(const std::vector<Item>& items, const std::vector<Slot>& owner, const std::vector<Slot>& kept);

}  // namespace pendula::codegen
