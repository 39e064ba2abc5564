#include "codegen/tape/tape_items.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace pendula::codegen {
namespace {

/// List scheduling: of all ready operations, the kind with the most instructions runs next, all of
/// them at once.
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
  void ready(Slot i) {
    const auto op = static_cast<std::size_t>(code_[i].op);
    ready_[op].push_back(i);
  }

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

class ItemMaker {
 public:
  ItemMaker(const Program& program, Slot gap)
      : p_(program), first_(program.first_instruction()), next_(first_ + gap) {
    out_.slot.resize(first_ + p_.instructions.size());
    for (Slot i = 0; i < first_; ++i) out_.slot[i] = i < p_.inputs ? i : i + gap;
    out_.owner.assign(next_, no_owner);
  }

  TapeItems make() && {
    Schedule(p_).each_run([&](Op op, const std::vector<Slot>& members) {
      if (op == Op::solve)
        for (Slot i : members) add_linear(i);
      else
        add_run(op, members);
    });
    return std::move(out_);
  }

 private:
  void add_linear(Slot i) {
    const Instruction& code = p_.instructions[i];
    if (code.part == Part::component) {  // already follows its head
      out_.slot[first_ + i] = out_.slot[code.operand[0]] + code.operand[1];
      return;
    }
    Item item;
    for (Slot k = 0; k < static_cast<Slot>(code.extras()); ++k)
      item.reads.push_back(out_.slot[p_.extra[code.first_extra + k]]);
    if (code.part == Part::solve) item.reads.push_back(out_.slot[code.operand[0]]);
    out_.slot[first_ + i] = own(std::move(item), static_cast<Slot>(code.results()), i);
  }

  /// The slots of a new item.
  Slot own(Item item, Slot size, Slot instruction) {
    item.result = next_;
    item.size = size;
    next_ += size;
    out_.owner.resize(next_, static_cast<Slot>(out_.items.size()));
    out_.items.push_back(std::move(item));
    out_.instruction.push_back(instruction);
    return out_.items.back().result;
  }

  Slot operand(Slot i, int k) const { return out_.slot[p_.instructions[i].operand[k]]; }

  void add_run(Op op, const std::vector<Slot>& members) {
    const int arity = info(op).arity;
    std::size_t regular = 0;
    std::vector<std::uint32_t> order(members.size());
    std::iota(order.begin(), order.end(), 0U);
    if (has_loop(op)) {
      std::vector<Pair> pairs;
      const bool commutes = op == Op::add || op == Op::mul;
      for (Slot i : members) {
        Slot a = operand(i, 0), b = arity > 1 ? operand(i, 1) : 0;
        if (commutes && a > b) std::swap(a, b);
        pairs.push_back({a, b});
      }
      const Arrangement arranged = arrange(pairs);
      order = arranged.order;
      for (const Stretch& s : arranged.stretches) {
        const Pair from = pairs[order[s.first]];
        const VectorLoop loop{
            op, 0, static_cast<Slot>(s.count), {from.a, from.b}, {s.stride[0], arity > 1 ? s.stride[1] : 0}};
        add_stretch(loop, std::span(order).subspan(s.first, s.count), members);
        regular = s.first + s.count;
      }
    }
    for (std::size_t k = regular; k < order.size(); ++k) add_single(members[order[k]]);
  }

  /// Adds a stretch in parts whose operands come from one item each.
  void add_stretch(const VectorLoop& whole, std::span<const std::uint32_t> order,
                   const std::vector<Slot>& members) {
    constexpr Slot worth_it = 8;
    for (Slot begin = 0; begin < whole.count;) {
      VectorLoop part = whole;
      for (int k = 0; k < 2; ++k) part.operand[k] += begin * whole.stride[k];
      Slot end = begin + 1;
      const auto same = [&](int k) {
        return out_.owner[whole.operand[k] + end * whole.stride[k]] == out_.owner[part.operand[k]];
      };
      while (end < whole.count && same(0) && same(1)) ++end;
      part.count = end - begin;
      if (part.count >= worth_it) {
        Item item;
        item.is_loop = true;
        item.loop = part;
        const Slot at = own(std::move(item), part.count, members[order[begin]]);
        out_.items.back().loop.result = at;
        for (Slot k = 0; k < part.count; ++k) out_.slot[first_ + members[order[begin + k]]] = at + k;
        out_.in_loops += part.count;
      } else {
        for (Slot k = begin; k < end; ++k) add_single(members[order[k]]);
      }
      begin = end;
    }
  }

  void add_single(Slot i) {
    Item item;
    for (int k = 0; k < info(p_.instructions[i].op).arity; ++k) item.reads.push_back(operand(i, k));
    out_.slot[first_ + i] = own(std::move(item), 1, i);
  }

  const Program& p_;
  Slot first_, next_;
  TapeItems out_;
};

}  // namespace

TapeItems items_of(const Program& program, Slot gap) { return ItemMaker(program, gap).make(); }

}  // namespace pendula::codegen
