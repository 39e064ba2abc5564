// Kernels: what is compiled once is remembered by the expressions it computes.
#include "codegen/kernel/kernel.hpp"

#include <mutex>

#include "base/error.hpp"
#include "codegen/kernel/jit_policy.hpp"
#include "codegen/program/contract.hpp"
#include "codegen/program/program_cache.hpp"
#include "codegen/tape/tape.hpp"

namespace pendula::codegen {

struct Kernel::Code {
  Tape tape;
  TieredCode tiers;
  explicit Code(Program program)
      : tape(program), tiers(std::move(program), tape.regular_share(), tape.workspace_size()) {}
  std::size_t workspace_size() const { return tiers.room(); }
};

Kernel::Kernel(std::span<const Expr> outputs, std::span<const Expr> inputs, Divisions divisions) {
  // Nodes are never changed or freed: equal ids mean the same function.
  static Memory<Code> memory;
  static std::mutex mutex;
  Key key;
  key.reserve(outputs.size() + inputs.size() + 2);
  key.push_back(static_cast<std::uint32_t>(divisions));
  for (Expr e : inputs) key.push_back(e.id());
  key.push_back(static_cast<std::uint32_t>(inputs.size()));
  for (Expr e : outputs) key.push_back(e.id());
  const std::lock_guard lock(mutex);
  code_ = memory.find(key);
  if (!code_) {
    Program program = lower(outputs, inputs);
    if (divisions == Divisions::shared) program = with_shared_reciprocals(program);
    code_ = std::make_shared<Code>(std::move(program));
    memory.add(key, code_, code_->tape.operations());
  }
  input_count_ = inputs.size();
  output_count_ = outputs.size();
  slots_ = code_->workspace_size();
}

std::size_t Kernel::operations() const { return code_ ? code_->tape.operations() : 0; }

double* Kernel::work() const {
  work_.resize(slots_);
  return work_.data();
}

std::vector<double> Kernel::operator()(std::span<const double> in) const {
  PENDULA_ASSERT(in.size() == input_count_, "a kernel got the wrong number of inputs");
  std::vector<double> out(outputs());
  (*this)(in.data(), out.data());
  return out;
}

void Kernel::run(const double* in, double* out, double* w) const {
  if (!code_) return;
  if (const Machine* machine = code_->tiers.code())
    machine->run(in, out, w);
  else
    code_->tape.run(in, out, w);
}

bool Kernel::accelerate() const { return code_ && code_->tiers.compile(); }
bool Kernel::is_machine_code() const { return code_ && code_->tiers.made(); }

}  // namespace pendula::codegen
