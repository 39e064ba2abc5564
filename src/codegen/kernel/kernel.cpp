// Kernels: compiled code is cached by the expressions that it computes.
#include "codegen/kernel/kernel.hpp"

#include <algorithm>
#include <mutex>

#include "base/error.hpp"
#include "codegen/kernel/jit_policy.hpp"
#include "codegen/program/checked.hpp"
#include "codegen/program/contract.hpp"
#include "codegen/program/program_cache.hpp"
#include "codegen/tape/tape.hpp"

namespace pendula::codegen {

struct Kernel::Code {
  /// A program as a tape and as machine code.
  struct Tiers {
    Tape tape;
    TieredCode code;
    explicit Tiers(Program program)
        : tape(program), code(std::move(program), tape.regular_share(), tape.workspace_size()) {}

    void run(const double* in, double* out, double* work) {
      if (const Machine* machine = code.code())
        machine->run(in, out, work);
      else
        tape.run(in, out, work);
    }
  };

  Code(std::span<const Expr> outputs, std::span<const Expr> inputs, Divisions divisions)
      : outputs_(outputs.begin(), outputs.end()),
        inputs_(inputs.begin(), inputs.end()),
        divisions_(divisions) {
    Program program = lower_checked(outputs_, inputs_);
    is_checked_ = program.results.size() > outputs_.size();
    first_ = made(std::move(program));
  }

  Tiers& tiers() { return *first_; }
  std::size_t workspace_size() const { return first_->code.room() + (is_checked_ ? outputs_.size() + 1 : 0); }
  std::size_t operations() const { return first_->tape.operations(); }

  void run(const double* in, double* out, double* work) {
    if (!is_checked_) return first_->run(in, out, work);
    double* const results = work + first_->code.room();
    first_->run(in, results, work);
    if (results[outputs_.size()] == 1)
      std::copy_n(results, outputs_.size(), out);
    else
      run_with_pivots(in, out);
  }

 private:
  std::unique_ptr<Tiers> made(Program program) const {
    return std::make_unique<Tiers>(divisions_ == Divisions::shared ? with_shared_reciprocals(program)
                                                                   : std::move(program));
  }

  void run_with_pivots(const double* in, double* out) {
    std::call_once(once_, [this] { pivoted_ = made(lower(outputs_, inputs_)); });
    static thread_local std::vector<double> work;
    if (work.size() < pivoted_->code.room()) work.resize(pivoted_->code.room());
    pivoted_->run(in, out, work.data());
  }

  std::vector<Expr> outputs_, inputs_;
  Divisions divisions_;
  bool is_checked_ = false;                 ///< an additional result tells whether the others are valid
  std::unique_ptr<Tiers> first_, pivoted_;  ///< the second is created on demand
  std::once_flag once_;
};

Kernel::Kernel(std::span<const Expr> outputs, std::span<const Expr> inputs, Divisions divisions) {
  // nodes are immutable: equal ids denote the same function
  static ProgramCache<Code> memory;
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
    code_ = std::make_shared<Code>(outputs, inputs, divisions);
    memory.add(key, code_, code_->operations());
  }
  input_count_ = inputs.size();
  output_count_ = outputs.size();
  slots_ = code_->workspace_size();
}

std::size_t Kernel::operations() const { return code_ ? code_->operations() : 0; }

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
  if (code_) code_->run(in, out, w);
}

bool Kernel::accelerate() const { return code_ && code_->tiers().code.compile(); }
bool Kernel::is_machine_code() const { return code_ && code_->tiers().code.made(); }

}  // namespace pendula::codegen
