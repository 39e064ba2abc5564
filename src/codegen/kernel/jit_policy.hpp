// Two tiers of a kernel: the tape at once, machine code after as many evaluations as pay for compiling it.
//
// Compiling costs some 50 µs + 0.15 µs per instruction, an evaluation by machine code saves some 0.4 ns per
// instruction: jit_policy.cpp computes the break-even point from these. Programs that are very long (the code
// leaves the second-level cache) or mostly loops stay on the tape, which has vector loops; code for the
// latter is made only where packs.hpp makes four operations of one.
#pragma once

#include <atomic>
#include <mutex>

#include "codegen/machine/machine.hpp"

namespace pendula::codegen {

class TieredCode {
 public:
  /// regular: the part of the tape's operations that are loops; tape_room: numbers
  /// of workspace that it takes.
  TieredCode(Program program, double regular, std::size_t tape_room);

  /// The code, if there is some already. Counts as an evaluation.
  const Machine* code() {
    if (const Machine* machine = ready_.load(std::memory_order_acquire)) return machine;
    // Lost counts of other threads do not matter, only that the number falls.
    const long left = left_.load(std::memory_order_relaxed) - 1;
    left_.store(left, std::memory_order_relaxed);
    return left == 0 ? compile() : nullptr;
  }
  /// Makes the code now; nothing where it does not pay for the size or cannot be made.
  const Machine* compile();
  /// Numbers of workspace that the tape and the code take; where code would take more, the tape remains.
  std::size_t room() const { return room_; }
  const Machine* made() const { return ready_.load(std::memory_order_acquire); }

 private:
  std::atomic<const Machine*> ready_{nullptr};
  std::atomic<long> left_;
  bool is_regular_;
  std::size_t room_;
  std::once_flag once_;
  Program program_;
  std::unique_ptr<const Machine> machine_;
};

}  // namespace pendula::codegen
