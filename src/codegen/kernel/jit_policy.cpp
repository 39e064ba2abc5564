#include "codegen/kernel/jit_policy.hpp"

namespace pendula::codegen {
namespace {

// Beyond this the code leaves the second-level cache and the tape is faster: docs/decisions/010.
constexpr std::size_t largest = 100'000;

// A large model that repeats itself: the loops of the tape are faster than code without loops.
constexpr std::size_t large_regular = 2'000;
constexpr double mostly_regular = 0.8;

/// Code costs about 50 µs + 0.15 µs per instruction and saves about 0.4 ns per instruction and evaluation.
long break_even(const Program& program) {
  const std::size_t n = program.instructions.size();
  if (n == 0 || n > largest || !Machine::available()) return -1;
  return 400 + static_cast<long>(125'000 / n);
}

}  // namespace

TieredCode::TieredCode(Program program, double regular)
    : left_(break_even(program)),
      worth_code_(program.instructions.size() < large_regular || regular < mostly_regular) {
  if (left_ > 0) program_ = std::move(program);  // else code is never made
  if (!worth_code_) left_ = -1;
}

const Machine* TieredCode::compile() {
  std::call_once(once_, [this] {
    if (program_.instructions.empty() || !worth_code_) return;
    machine_ = Machine::compile(program_);
    ready_.store(machine_.get(), std::memory_order_release);
  });
  return made();
}

}  // namespace pendula::codegen
