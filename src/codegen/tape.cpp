// Program -> grouped tape: schedule into runs of one operation, number the slots. And its interpreter.
//
// Workspace layout: inputs | constants | results, whose places are used again (Layout).
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

/// Places in the workspace, taken and given back; the one given back last is taken first while it is still in
/// the cache.
class Places {
 public:
  explicit Places(Slot first) : end_(first) {}
  Slot take(Slot size) {
    for (std::size_t k = free_.size(); k-- > 0;) {
      if (free_[k].size < size) continue;
      const Slot at = free_[k].at;
      free_[k].at += size, free_[k].size -= size;
      if (free_[k].size == 0) free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(k));
      return at;
    }
    const Slot at = end_;
    end_ += size;
    return at;
  }
  void give(Slot at, Slot size) {
    for (std::size_t k = 0; k < free_.size(); ++k) {  // joined with its neighbours
      Hole& hole = free_[k];
      if (hole.at + hole.size != at && at + size != hole.at) continue;
      at = std::min(at, hole.at), size += hole.size;
      free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(k));
      k = static_cast<std::size_t>(-1);
    }
    free_.push_back({at, size});
    constexpr std::size_t many = 64;  // small holes are forgotten
    if (free_.size() > many)
      free_.erase(std::min_element(free_.begin(), free_.end(),
                                   [](const Hole& p, const Hole& q) { return p.size < q.size; }));
  }
  Slot end() const { return end_; }

 private:
  struct Hole {
    Slot at, size;
  };
  std::vector<Hole> free_;
  Slot end_;
};

}  // namespace

/// Runs in order of execution, and where their results are.
class Tape::Layout {
 public:
  Layout(const Program& program, Tape& tape)
      : p_(program), tape_(tape), first_(program.first_instruction()), places_(first_) {
    slot_.resize(first_ + p_.instructions.size());
    for (Slot i = 0; i < first_; ++i) slot_[i] = i;
    Schedule(p_).each_run([&](Op op, const std::vector<Slot>& members) { runs_.push_back({op, members}); });
    find_last_uses();
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (runs_[r].op == Op::solve)
        for (Slot i : runs_[r].members) add_linear(i);
      else
        add_run(runs_[r]);
      for (std::size_t dead : dying_[r]) places_.give(runs_[dead].at, runs_[dead].size);
    }
    for (Slot value : p_.results) {
      const Slot slot = slot_[value], output = static_cast<Slot>(tape_.output_count_++);
      std::vector<Copy>& copies = tape_.copies_;
      if (!copies.empty() && copies.back().slot + copies.back().count == slot)
        ++copies.back().count;
      else
        copies.push_back({slot, output, 1});
    }
    tape_.slots_ = places_.end();
    find_used_inputs();
  }

 private:
  struct Members {
    Op op;
    std::vector<Slot> members;
    Slot at = 0, size = 0;
  };

  /// dying_[r]: runs whose results nobody reads after run r. Those of linear systems stay.
  void find_last_uses() {
    std::vector<std::size_t> run_of(p_.instructions.size()), last(runs_.size());
    for (std::size_t r = 0; r < runs_.size(); ++r)
      for (Slot i : runs_[r].members) run_of[i] = r;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      last[r] = r;
      for (Slot i : runs_[r].members)
        p_.each_operand(p_.instructions[i], [&](Slot value) {
          if (value >= first_) last[run_of[value - first_]] = r;
        });
    }
    for (Slot value : p_.results)
      if (value >= first_) last[run_of[value - first_]] = runs_.size();
    dying_.resize(runs_.size() + 1);
    for (std::size_t r = 0; r < runs_.size(); ++r)
      if (runs_[r].op != Op::solve) dying_[last[r]].push_back(r);
  }

  /// A model has many arguments, of which a kernel may need few.
  void find_used_inputs() {
    std::vector<char> used(p_.inputs, 0);
    const auto use = [&](Slot value) {
      if (value < p_.inputs) used[value] = 1;
    };
    for (const Instruction& i : p_.instructions) p_.each_operand(i, use);
    std::for_each(p_.results.begin(), p_.results.end(), use);
    constexpr std::size_t near = 16;  // copied along
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      auto& ranges = tape_.used_inputs_;
      if (ranges.empty() || i > ranges.back().second + near) ranges.emplace_back(i, i);
      ranges.back().second = i + 1;
    }
  }

  void add_linear(Slot i) {
    const Instruction& code = p_.instructions[i];
    Slot& result = slot_[first_ + i];
    const Slot from = slot_[code.operand[0]];
    if (code.part == Part::component) {  // lies behind its head already
      result = from + code.operand[1];
      return;
    }
    const bool factor = code.part == Part::factor;
    result = places_.take(static_cast<Slot>(code.results()));
    tape_.runs_.push_back({Op::solve, result, 1, static_cast<Slot>(tape_.linear_.size()), 0, 0});
    tape_.linear_.push_back({factor, code.size, static_cast<Slot>(tape_.operands_.size()),
                             factor ? result : from, code.transposed});
    for (int k = 0; k < code.extras(); ++k)
      tape_.operands_.push_back(slot_[p_.extra[code.first_extra + static_cast<Slot>(k)]]);
  }

  void add_run(Members& run) {
    const int arity = info(run.op).arity;
    const auto operand = [&](Slot i, int k) {
      return slot_[p_.instructions[i].operand[static_cast<std::size_t>(k)]];
    };
    run.size = static_cast<Slot>(run.members.size());
    run.at = places_.take(run.size);
    std::vector<Stretch> stretches;
    if (has_loop(run.op)) {
      std::vector<Pair> pairs;
      const bool commutes = run.op == Op::add || run.op == Op::mul;
      for (Slot i : run.members) {
        Slot a = operand(i, 0), b = arity > 1 ? operand(i, 1) : 0;
        if (commutes && a > b) std::swap(a, b);
        pairs.push_back({a, b});
      }
      const Arrangement arranged = arrange(pairs);
      std::vector<Slot> members;
      for (std::uint32_t k : arranged.order) members.push_back(run.members[k]);
      run.members = std::move(members);
      stretches = arranged.stretches;
      for (const Stretch& s : stretches) {
        const Pair from = pairs[arranged.order[s.first]];
        tape_.pieces_.push_back({run.op,
                                 run.at + static_cast<Slot>(s.first),
                                 static_cast<Slot>(s.count),
                                 {from.a, from.b},
                                 {s.stride[0], arity > 1 ? s.stride[1] : 0}});
      }
    }
    const std::size_t regular = stretches.empty() ? 0 : stretches.back().first + stretches.back().count;
    tape_.runs_.push_back({run.op, run.at + static_cast<Slot>(regular), run.size - static_cast<Slot>(regular),
                           static_cast<Slot>(tape_.operands_.size()),
                           static_cast<Slot>(tape_.pieces_.size() - stretches.size()),
                           static_cast<Slot>(stretches.size())});
    for (int k = 0; k < arity; ++k)
      for (std::size_t i = regular; i < run.members.size(); ++i)
        tape_.operands_.push_back(operand(run.members[i], k));
    for (std::size_t i = 0; i < run.members.size(); ++i)
      slot_[first_ + run.members[i]] = run.at + static_cast<Slot>(i);
  }

  const Program& p_;
  Tape& tape_;
  Slot first_;
  Places places_;
  std::vector<Slot> slot_;
  std::vector<Members> runs_;
  std::vector<std::vector<std::size_t>> dying_;
};

Tape::Tape(const Program& low) : input_count_(low.inputs), constants_(low.constants) { Layout(low, *this); }

double Tape::regular_share() const {
  std::size_t regular = 0;
  for (const Piece& piece : pieces_) regular += piece.count;
  return static_cast<double>(regular) / static_cast<double>(std::max<std::size_t>(operations(), 1));
}

std::size_t Tape::operations() const {
  std::size_t n = 0;
  for (const Run& run : runs_) n += run.count;
  for (const Piece& piece : pieces_) n += piece.count;
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
  constexpr Slot worth_a_call = 16;
  for (const auto& [first, end] : used_inputs_) std::copy(in + first, in + end, w + first);
  std::copy(constants_.begin(), constants_.end(), w + input_count_);
  for (const Run& run : runs_) {
    for (Slot k = 0; k < run.pieces; ++k) run_piece(pieces_[run.first_piece + k], w);
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
  for (const Copy& c : copies_) {
    const double* from = w + c.slot;
    double* to = out + c.output;
    if (c.count >= worth_a_call)
      std::copy_n(from, c.count, to);
    else
      for (Slot k = 0; k < c.count; ++k) to[k] = from[k];
  }
}

}  // namespace pendula::codegen
