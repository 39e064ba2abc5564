// Expr graph -> grouped tape: lower, schedule into runs of one operation, number the slots.
//
// Workspace layout: inputs | constants | results in order of execution. Results of one run are contiguous.
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "base/error.hpp"
#include "codegen/kernel.hpp"
#include "expr/solve.hpp"

namespace pendula::codegen {
namespace {

using Slot = std::uint32_t;

/// Parts of a linear system: its matrix is factored once, every right side solved, components taken out.
enum class Part : std::uint8_t { none, factor, solve, component };

/// An operation on earlier values. Values are numbered: inputs and constants first, then instructions.
/// factor: `extra` holds the matrix row by row; solve: operand[0] is the factor, `extra` the right side;
/// component: operand[0] is the solve, operand[1] the number of the component.
struct Instruction {
  Op op;
  std::array<Slot, 3> operand{};
  Part part = Part::none;
  bool transposed = false;
  int size = 0;
  std::vector<Slot> extra{};
};

/// x^n for integers |n| ≤ 16 becomes products: no call into libm, and x² is rounded once.
long product_exponent(Expr node) {
  const mpq_class* n = node.op() == Op::pow ? exact_value(node.operand(1)) : nullptr;
  return n && n->get_den() == 1 && abs(*n) <= 16 ? n->get_num().get_si() : 0;
}

class Lowering {
 public:
  Lowering(std::span<const Expr> outputs, std::span<const Expr> inputs) {
    for (Expr input : inputs) values_[input] = count_++;
    const std::vector<Expr> order = topological(outputs);
    for (Expr node : order)
      if (!has_input(node)) add_leaf(node);
    constant(1.0);  // for negative powers
    first_instruction = count_;
    for (Expr node : order)
      if (!values_.has(node)) values_[node] = lower(node);
    for (Expr output : outputs) results.push_back(values_[output]);
  }

  std::vector<double> constants;
  std::vector<Instruction> instructions;
  std::vector<Slot> results;
  Slot first_instruction = 0;

 private:
  bool has_input(Expr node) { return values_.has(node); }

  void add_leaf(Expr node) {
    if (node.is_constant()) {
      values_[node] = constant(constant_value(node));
    } else if (node.is_symbol()) {
      const Symbol& s = symbol_of(node);
      if (s.kind != Kind::constant)
        throw Error(text("'", s.name, std::string(s.order, '\''), "' has no value here"));
      values_[node] = constant(constant_value(*s.value));
    } else if (node.op() == Op::call) {
      throw Error(text("'", call_of(node).name,
                       "' is an unspecified function and has no values; substitute it with subs"));
    }
  }

  Slot constant(double value) {
    if (value == 1.0 && one_) return one_;
    constants.push_back(value);
    if (value == 1.0) one_ = count_;
    return count_++;
  }

  Slot emit(Op op, Slot a, Slot b = 0, Slot c = 0) {
    instructions.push_back({op, {a, b, c}});
    return count_++;
  }

  Slot emit(Instruction instruction) {
    instructions.push_back(std::move(instruction));
    return count_++;
  }

  Slot lower_solution(Expr node) {
    if (const int k = component_of(node))
      return emit({Op::solve, {values_[head_of(node)], static_cast<Slot>(k), 0}, Part::component});
    const LinearSystem& s = system_of(node);
    const auto [factor, made] = factors_.try_emplace(s.matrix, 0);
    if (made) {
      Instruction matrix{Op::solve, {}, Part::factor, false, s.size};
      for (int i = 0; i < s.size; ++i)
        for (int j = 0; j < s.size; ++j)
          matrix.extra.push_back(values_[s.transposed ? s.a(j, i) : s.a(i, j)]);
      factor->second = emit(std::move(matrix));
    }
    Instruction solution{Op::solve, {factor->second}, Part::solve, s.transposed, s.size};
    for (int i = 0; i < s.size; ++i) solution.extra.push_back(values_[s.b(i)]);
    return emit(std::move(solution));
  }

  Slot lower(Expr node) {
    if (node.op() == Op::solve) return lower_solution(node);
    const auto x = node.operands();
    const Slot a = values_[x[0]];
    if (const long n = product_exponent(node)) return power(a, n);
    return emit(node.op(), a, x.size() > 1 ? values_[x[1]] : 0, x.size() > 2 ? values_[x[2]] : 0);
  }

  Slot power(Slot base, long n) {
    if (n < 0) return emit(Op::div, one_, power(base, -n));
    if (n == 1) return base;
    const Slot half = power(base, n / 2), square = emit(Op::mul, half, half);
    return n % 2 ? emit(Op::mul, square, base) : square;
  }

  NodeMap<Slot> values_;
  std::unordered_map<std::uint32_t, Slot> factors_;  // by the number of the matrix
  Slot count_ = 0, one_ = 0;
};

int arity(Op op) { return info(op).arity; }

/// How many of operand[] are values: the number of a component is not.
int plain_operands(const Instruction& i) {
  if (i.part == Part::none) return arity(i.op);
  return i.part == Part::factor ? 0 : 1;
}

/// List scheduling: of all operations that are ready, the one with most instructions runs next, all of them
/// at once.
class Schedule {
 public:
  Schedule(const std::vector<Instruction>& instructions, Slot first) : code_(instructions), first_(first) {
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
    for (Slot i = 0; i < code_.size(); ++i) {
      for (int k = 0; k < plain_operands(code_[i]); ++k)
        if (code_[i].operand[k] >= first_) use(code_[i].operand[k] - first_, i);
      for (Slot value : code_[i].extra)
        if (value >= first_) use(value - first_, i);
    }
  }

  void count_users() {
    user_start_.assign(code_.size() + 1, 0);
    each_use([&](Slot producer, Slot user) { ++user_start_[producer + 1], ++waiting_[user]; });
    for (std::size_t i = 0; i < code_.size(); ++i) user_start_[i + 1] += user_start_[i];
    users_.resize(user_start_.back());
    std::vector<Slot> next(user_start_.begin(), user_start_.end() - 1);
    each_use([&](Slot producer, Slot user) { users_[next[producer]++] = user; });
  }

  const std::vector<Instruction>& code_;
  Slot first_;
  std::vector<Slot> waiting_, user_start_, users_;
  std::array<std::vector<Slot>, static_cast<std::size_t>(end_op)> ready_;
};

}  // namespace

Kernel::Kernel(std::span<const Expr> outputs, std::span<const Expr> inputs) : input_count_(inputs.size()) {
  const Lowering low(outputs, inputs);
  constants_ = low.constants;
  std::vector<Slot> slot(low.first_instruction + low.instructions.size());
  for (Slot i = 0; i < low.first_instruction; ++i) slot[i] = i;
  slots_ = low.first_instruction;
  const auto add_linear = [&](Slot i) {
    const Instruction& code = low.instructions[i];
    Slot& result = slot[low.first_instruction + i];
    const Slot from = slot[code.operand[0]];
    if (code.part == Part::component) {  // lies behind its head already
      result = from + code.operand[1];
      return;
    }
    const bool factor = code.part == Part::factor;
    const auto n = static_cast<std::size_t>(code.size);
    result = static_cast<Slot>(slots_);
    slots_ += factor ? n * n + n : n;
    runs_.push_back({Op::solve, result, 1, static_cast<Slot>(linear_.size())});
    linear_.push_back(
        {factor, code.size, static_cast<Slot>(operands_.size()), factor ? result : from, code.transposed});
    for (Slot value : code.extra) operands_.push_back(slot[value]);
  };
  Schedule(low.instructions, low.first_instruction).each_run([&](Op op, const std::vector<Slot>& members) {
    if (op == Op::solve) {
      std::for_each(members.begin(), members.end(), add_linear);
      return;
    }
    runs_.push_back({op, static_cast<Slot>(slots_), static_cast<Slot>(members.size()),
                     static_cast<Slot>(operands_.size())});
    for (int k = 0; k < arity(op); ++k)
      for (Slot i : members) operands_.push_back(slot[low.instructions[i].operand[k]]);
    for (Slot i : members) slot[low.first_instruction + i] = static_cast<Slot>(slots_++);
  });
  for (Slot value : low.results) output_slot_.push_back(slot[value]);
}

std::size_t Kernel::operations() const {
  std::size_t n = 0;
  for (const Run& run : runs_) n += run.count;
  return n;
}

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
