// Program -> grouped tape: schedule into runs of one operation, number the slots. And its interpreter.
//
// Workspace layout: inputs | constants | results in order of execution. Results of one run are contiguous.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "codegen/tape.hpp"
#include "expr/solve.hpp"

namespace pendula::codegen {
namespace {

/// List scheduling: of all operations that are ready, the one with most instructions runs next, all of them
/// at once.
class Schedule {
 public:
  explicit Schedule(const Program& program)
      : program_(program), code_(program.instructions), first_(program.first_instruction()) {
    waiting_.resize(code_.size());
    count_users();
    for (Slot i = 0; i < code_.size(); ++i)
      if (waiting_[i] == 0) ready(i);
  }

  /// Calls run(op, members) for every run in order of execution.
  template <class RunCall>
  void each_run(const RunCall& run) {
    while (true) {
      auto fullest = std::max_element(ready_.begin(), ready_.end(),
                                      [](const auto& a, const auto& b) { return a.size() < b.size(); });
      if (fullest->empty()) return;
      const std::vector<Slot> members = std::exchange(*fullest, {});
      run(static_cast<Op>(fullest - ready_.begin()), members);
      for (Slot i : members)
        for (Slot k = user_start_[i]; k < user_start_[i + 1]; ++k)
          if (--waiting_[users_[k]] == 0) ready(users_[k]);
    }
  }

 private:
  void ready(Slot i) { ready_[static_cast<std::size_t>(code_[i].op)].push_back(i); }

  template <class Use>
  void each_use(const Use& use) const {
    for (Slot i = 0; i < code_.size(); ++i)
      program_.each_operand(code_[i], [&](Slot value) {
        if (value >= first_) use(value - first_, i);
      });
  }

  void count_users() {
    user_start_.assign(code_.size() + 1, 0);
    each_use([&](Slot producer, Slot user) { ++user_start_[producer + 1], ++waiting_[user]; });
    for (std::size_t i = 0; i < code_.size(); ++i) user_start_[i + 1] += user_start_[i];
    users_.resize(user_start_.back());
    std::vector<Slot> next(user_start_.begin(), user_start_.end() - 1);
    each_use([&](Slot producer, Slot user) { users_[next[producer]++] = user; });
  }

  const Program& program_;
  const std::vector<Instruction>& code_;
  Slot first_;
  std::vector<Slot> waiting_, user_start_, users_;
  std::array<std::vector<Slot>, static_cast<std::size_t>(end_op)> ready_;
};

}  // namespace

Tape::Tape(const Program& low) : input_count_(low.inputs) {
  constants_ = low.constants;
  const Slot first = low.first_instruction();
  std::vector<Slot> slot(first + low.instructions.size());
  for (Slot i = 0; i < first; ++i) slot[i] = i;
  slots_ = first;
  const auto add_linear = [&](Slot i) {
    const Instruction& code = low.instructions[i];
    Slot& result = slot[first + i];
    const Slot from = slot[code.operand[0]];
    if (code.part == Part::component) {  // lies behind its head already
      result = from + code.operand[1];
      return;
    }
    const bool factor = code.part == Part::factor;
    result = static_cast<Slot>(slots_);
    slots_ += static_cast<std::size_t>(code.results());
    runs_.push_back({Op::solve, result, 1, static_cast<Slot>(linear_.size())});
    linear_.push_back(
        {factor, code.size, static_cast<Slot>(operands_.size()), factor ? result : from, code.transposed});
    for (int k = 0; k < code.extras(); ++k)
      operands_.push_back(slot[low.extra[code.first_extra + static_cast<Slot>(k)]]);
  };
  Schedule(low).each_run([&](Op op, const std::vector<Slot>& members) {
    if (op == Op::solve) {
      std::for_each(members.begin(), members.end(), add_linear);
      return;
    }
    runs_.push_back({op, static_cast<Slot>(slots_), static_cast<Slot>(members.size()),
                     static_cast<Slot>(operands_.size())});
    for (int k = 0; k < info(op).arity; ++k)
      for (Slot i : members)
        operands_.push_back(slot[low.instructions[i].operand[static_cast<std::size_t>(k)]]);
    for (Slot i : members) slot[first + i] = static_cast<Slot>(slots_++);
  });
  for (Slot value : low.results) output_slot_.push_back(slot[value]);
}

std::size_t Tape::operations() const {
  std::size_t n = 0;
  for (const Run& run : runs_) n += run.count;
  return n;
}

// Dense LU with partial pivoting on slots. All right sides with the same matrix, or with its transpose, share
// one factorisation.
void Tape::run_linear(const LinearStep& step, std::uint32_t result, double* w) const {
  const std::uint32_t* const operands = operands_.data() + step.first_operand;
  const int n = step.n, count = step.factor ? n * n : n;
  double* const r = w + result;
  for (int i = 0; i < count; ++i) r[i] = w[operands[i]];
  const double* const factors = w + step.factors;
  if (step.factor)
    lu_factor(r, r + n * n, n);
  else
    lu_solve(factors, factors + n * n, r, n, step.transposed);
}

void Tape::run(const double* in, double* out, double* w) const {
  std::copy(in, in + input_count_, w);
  std::copy(constants_.begin(), constants_.end(), w + input_count_);
  for (const Run& run : runs_) {
    const Slot* const o = operands_.data() + run.first_operand;
    double* const r = w + run.first_slot;
    const std::size_t n = run.count;
    switch (run.op) {
#define OP(name, arity, style, value, da, db, dc, lo, hi, latex, help)   \
  case Op::name:                                                         \
    for (std::size_t k = 0; k < n; ++k) {                                \
      [[maybe_unused]] const double a = w[o[k]];                         \
      [[maybe_unused]] const double b = arity > 1 ? w[o[n + k]] : 0;     \
      [[maybe_unused]] const double c = arity > 2 ? w[o[2 * n + k]] : 0; \
      r[k] = static_cast<double>(value);                                 \
    }                                                                    \
    break;
#include "expr/ops.def"
#undef OP
      case Op::solve:
        run_linear(linear_[run.first_operand], run.first_slot, w);
        break;
      default:
        internal_error(__FILE__, __LINE__, "not an operation on the tape");
    }
  }
  for (std::size_t i = 0; i < output_slot_.size(); ++i) out[i] = w[output_slot_[i]];
}

}  // namespace pendula::codegen
