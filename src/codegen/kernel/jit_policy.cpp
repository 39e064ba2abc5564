#include "codegen/kernel/jit_policy.hpp"

#include <algorithm>
#include <optional>

#include "codegen/program/packs.hpp"

namespace pendula::codegen {
namespace {

// larger code does not fit into the second-level cache, and the tape is faster: docs/decisions/010
constexpr std::size_t largest = 100'000;

// A large model with repeated structure: the loops of the tape are faster than code without loops, unless
// that performs four operations at once (measured: 1.3 and 0.24 µs for 500 points of Burgers' equation). Its
// code costs 0.3 µs per instruction and saves 0.23 ns per evaluation.
constexpr std::size_t large_regular = 2'000;
constexpr double mostly_regular = 0.8, wide_enough = 0.5;
constexpr long regular_break_even = 1'400;

/// Code costs about 50 µs + 0.15 µs per instruction and saves about 0.4 ns per instruction and evaluation.
/// Nothing where it never pays.
std::optional<long> break_even(std::size_t n, bool is_regular) {
  if (n == 0 || n > largest || !Machine::available()) return {};
  if (is_regular && n > longest_packed) return {};
  if (is_regular) return regular_break_even;
  return 400 + static_cast<long>(125'000 / n);
}

}  // namespace

TieredCode::TieredCode(Program program, double regular, std::size_t tape_room)
    : left_(0),
      is_regular_(program.instructions.size() >= large_regular && regular >= mostly_regular),
      room_(tape_room) {
  const std::size_t n = program.instructions.size();
  const auto evaluations = break_even(n, is_regular_);
  if (!evaluations) return;  // code is never generated
  left_ = *evaluations;
  room_ = std::max(room_, 128 + n / 4);
  program_ = std::move(program);
}

const Machine* TieredCode::compile() {
  std::call_once(once_, [this] {
    if (program_.instructions.empty()) return;
    const Program wide = packed(program_);
    if (!is_regular_ || cycles(wide) < wide_enough * cycles(program_)) machine_ = Machine::compile(wide);
    if (machine_ && machine_->workspace_size() > room_) machine_.reset();
    program_ = {};
    ready_.store(machine_.get(), std::memory_order_release);
  });
  return made();
}

}  // namespace pendula::codegen
