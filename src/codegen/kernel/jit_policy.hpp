// When a kernel deserves machine code: after as many evaluations as making it costs.
#pragma once

#include <atomic>
#include <mutex>

#include "codegen/machine/machine.hpp"

namespace pendula::codegen {

class Hot {
 public:
  /// regular: the part of the tape's operations that are loops.
  Hot(Program program, double regular);

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
  const Machine* made() const { return ready_.load(std::memory_order_acquire); }
  /// Code for Machine::widest() points at once; nothing where there is none.
  const Machine* lanes();

 private:
  std::atomic<const Machine*> ready_{nullptr};
  std::atomic<long> left_;
  bool worth_code_;
  std::once_flag once_, lanes_once_;
  Program program_;
  std::unique_ptr<const Machine> machine_, lanes_;
};

}  // namespace pendula::codegen
