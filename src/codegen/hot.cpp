#include "codegen/hot.hpp"

#include <vector>

#include "codegen/kernel.hpp"

namespace pendula::codegen {
namespace {

// Beyond this the code leaves the second-level cache and the tape is faster (DESIGN.md §3).
constexpr std::size_t largest = 100'000;

/// Code costs about 50 µs + 0.15 µs per instruction and saves about 0.4 ns per instruction and evaluation.
long break_even(const Program& program) {
  const std::size_t n = program.instructions.size();
  if (n == 0 || n > largest || !Machine::available()) return -1;
  return 400 + static_cast<long>(125'000 / n);
}

}  // namespace

Hot::Hot(Program program) : left_(break_even(program)) {
  if (left_ > 0) program_ = std::move(program);  // else code is never made
}

const Machine* Hot::compile() {
  std::call_once(once_, [this] {
    if (program_.instructions.empty()) return;
    machine_ = Machine::compile(program_);
    ready_.store(machine_.get(), std::memory_order_release);
  });
  return made();
}

const Machine* Hot::lanes() {
  std::call_once(lanes_once_, [this] {
    if (!program_.instructions.empty() && Machine::available(4)) lanes_ = Machine::compile(program_, 4);
  });
  return lanes_.get();
}

void Kernel::run_many(const double* in, double* out, std::size_t points) const {
  constexpr std::size_t lanes = 4, worth_it = 64;
  const std::size_t n = inputs(), m = outputs();
  const Machine* machine = hot_ && points >= worth_it ? hot_->lanes() : nullptr;
  std::size_t done = 0;
  if (machine) {
    std::vector<double> x(lanes * n), y(lanes * m), work(machine->workspace_size());
    for (; done + lanes <= points; done += lanes) {
      for (std::size_t lane = 0; lane < lanes; ++lane)
        for (std::size_t k = 0; k < n; ++k) x[lanes * k + lane] = in[(done + lane) * n + k];
      machine->run(x.data(), y.data(), work.data());
      for (std::size_t lane = 0; lane < lanes; ++lane)
        for (std::size_t k = 0; k < m; ++k) out[(done + lane) * m + k] = y[lanes * k + lane];
    }
  }
  std::vector<double> work(workspace_size());
  for (; done < points; ++done) run(in + done * n, out + done * m, work.data());
}

bool Kernel::accelerate() const { return hot_ && hot_->compile(); }
bool Kernel::is_machine_code() const { return hot_ && hot_->made(); }

}  // namespace pendula::codegen
