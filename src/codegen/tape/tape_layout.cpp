// Program -> grouped tape: schedule into runs of one operation, find loops in them, fuse these, number the
// slots.
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <utility>

#include "codegen/tape/tape.hpp"

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
class Workspace {
 public:
  explicit Workspace(Slot first) : end_(first) {}
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

/// Items in a possible order, with slots of their own behind the inputs and constants; then loops, times, and
/// places in the workspace, which are used again.
class Tape::Layout {
 public:
  Layout(const Program& program, Tape& tape)
      : p_(program),
        tape_(tape),
        first_(program.first_instruction()),
        next_(first_ + gap),
        places_(rounded(first_ + gap)) {
    slot_.resize(first_ + p_.instructions.size());
    for (Slot i = 0; i < first_; ++i) slot_[i] = i < p_.inputs ? i : i + gap;
    owner_.assign(next_, no_owner);
    Schedule(p_).each_run([&](Op op, const std::vector<Slot>& members) {
      if (op == Op::solve)
        for (Slot i : members) add_linear(i);
      else
        add_run(op, members);
    });
    std::vector<Slot> results;
    for (Slot value : p_.results) results.push_back(slot_[value]);
    timing_ = fuse(items_, owner_, results);
    make_steps();
    find_last_uses(results);
    for (std::size_t s = 0; s < steps_.size(); ++s) emit(s);
    for (Slot& slot : results) slot = place(slot);
    tape_.output_count_ = results.size();
    tape_.copies_ = arrange_copies(results, static_cast<Slot>(p_.inputs));
    tape_.slots_ = places_.end();
    find_used_inputs();
  }

 private:
  /// Items that are one loop, or operations without pattern of one kind, or a linear system.
  struct Step {
    std::vector<Slot> items;
  };

  // ── items ──
  void add_linear(Slot i) {
    const Instruction& code = p_.instructions[i];
    if (code.part == Part::component) {  // lies behind its head already
      slot_[first_ + i] = slot_[code.operand[0]] + code.operand[1];
      return;
    }
    Item item;
    for (Slot k = 0; k < static_cast<Slot>(code.extras()); ++k)
      item.reads.push_back(slot_[p_.extra[code.first_extra + k]]);
    if (code.part == Part::solve) item.reads.push_back(slot_[code.operand[0]]);
    slot_[first_ + i] = own(std::move(item), static_cast<Slot>(code.results()), i);
  }

  /// The slots of a new item.
  Slot own(Item item, Slot size, Slot instruction) {
    item.result = next_, item.size = size;
    owner_.resize(next_ += size, static_cast<Slot>(items_.size()));
    items_.push_back(std::move(item));
    instruction_.push_back(instruction);
    return items_.back().result;
  }

  Slot operand(Slot i, int k) const { return slot_[p_.instructions[i].operand[k]]; }

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
        const Piece piece{
            op, 0, static_cast<Slot>(s.count), {from.a, from.b}, {s.stride[0], arity > 1 ? s.stride[1] : 0}};
        add_stretch(piece, std::span(order).subspan(s.first, s.count), members);
        regular = s.first + s.count;
      }
    }
    for (std::size_t k = regular; k < order.size(); ++k) add_single(members[order[k]]);
  }

  /// Pieces of a stretch whose operands come each from one item.
  void add_stretch(const Piece& whole, std::span<const std::uint32_t> order,
                   const std::vector<Slot>& members) {
    constexpr Slot worth_it = 8;
    for (Slot begin = 0; begin < whole.count;) {
      Piece part = whole;
      for (int k = 0; k < 2; ++k) part.operand[k] += begin * whole.stride[k];
      Slot end = begin + 1;
      const auto same = [&](int k) {
        return owner_[whole.operand[k] + end * whole.stride[k]] == owner_[part.operand[k]];
      };
      while (end < whole.count && same(0) && same(1)) ++end;
      part.count = end - begin;
      if (part.count >= worth_it) {
        Item item;
        item.is_piece = true, item.piece = part;
        const Slot at = own(std::move(item), part.count, members[order[begin]]);
        items_.back().piece.result = at;
        for (Slot k = 0; k < part.count; ++k) slot_[first_ + members[order[begin + k]]] = at + k;
        tape_.regular_ += part.count;
      } else {
        for (Slot k = begin; k < end; ++k) add_single(members[order[k]]);
      }
      begin = end;
    }
  }

  void add_single(Slot i) {
    Item item;
    for (int k = 0; k < info(p_.instructions[i].op).arity; ++k) item.reads.push_back(operand(i, k));
    slot_[first_ + i] = own(std::move(item), 1, i);
  }

  // ── steps ──
  void make_steps() {
    std::vector<Slot> order(items_.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto rank = [&](Slot i) {
      return std::pair(timing_.time[i], items_[i].is_piece ? timing_.loop[i] : 0);
    };
    std::stable_sort(order.begin(), order.end(), [&](Slot i, Slot j) { return rank(i) < rank(j); });
    step_of_.resize(items_.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const Slot i = order[k];
      if (k == 0 || rank(i) != rank(order[k - 1]) || !same_kind(i, order[k - 1])) steps_.emplace_back();
      steps_.back().items.push_back(i);
      step_of_[i] = static_cast<Slot>(steps_.size() - 1);
    }
  }
  /// Of one loop, or of one operation and independent: of one run.
  bool same_kind(Slot i, Slot j) const {
    if (items_[i].is_piece) return true;
    const Op op = p_.instructions[instruction_[i]].op;
    if (op == Op::solve || op != p_.instructions[instruction_[j]].op) return false;
    for (Slot slot : items_[i].reads)
      if (const Slot from = owner_[slot]; from != no_owner && step_open(from)) return false;
    return true;
  }
  bool step_open(Slot item) const {
    return !items_[item].is_piece && !steps_.empty() && step_of_[item] == steps_.size() - 1 &&
           timing_.time[item] == timing_.time[steps_.back().items.back()];
  }

  /// dying_[s]: what nobody reads after step s. Results of linear systems stay.
  void find_last_uses(const std::vector<Slot>& results) {
    std::vector<Slot> last(step_of_);
    const auto use = [&](Slot slot, Slot step) {
      if (const Slot from = owner_[slot]; from != no_owner) last[from] = std::max(last[from], step);
    };
    for (std::size_t i = 0; i < items_.size(); ++i) {
      for (Slot slot : items_[i].reads) use(slot, step_of_[i]);
      if (items_[i].is_piece)
        for (Slot slot : items_[i].piece.operand) use(slot, step_of_[i]);
    }
    const auto never = static_cast<Slot>(steps_.size());
    for (Slot slot : results) use(slot, never);
    dying_.resize(steps_.size() + 1);
    for (const Step& step : steps_) {
      const Slot first = step.items[0];
      if (is_linear(first)) continue;
      if (!items_[first].is_piece) {  // together
        Slot end = 0;
        for (Slot i : step.items) end = std::max(end, last[i]);
        dying_[end].push_back({first, rounded(static_cast<Slot>(step.items.size()))});
      } else {
        for (Slot i : step.items)
          if (!timing_.local[i]) dying_[last[i]].push_back({i, rounded(items_[i].size)});
      }
    }
    at_.resize(items_.size());
  }
  bool is_linear(Slot i) const { return p_.instructions[instruction_[i]].op == Op::solve; }
  Slot place(Slot slot) const {
    const Slot from = owner_[slot];
    return from == no_owner ? slot : at_[from] + (slot - items_[from].result);
  }
  static Slot rounded(Slot size) { return (size + 7) / 8 * 8; }  // loops begin with a line of the cache

  void emit(std::size_t s) {
    const Step& step = steps_[s];
    const Item& item = items_[step.items[0]];
    if (item.is_piece)
      emit_loop(step);
    else if (is_linear(step.items[0]))
      emit_linear(step.items[0]);
    else
      emit_run(step);
    for (const auto& [dead, size] : dying_[s]) places_.give(at_[dead], size);
  }

  void emit_run(const Step& step) {
    const Op op = p_.instructions[instruction_[step.items[0]]].op;
    const auto count = static_cast<Slot>(step.items.size());
    const Slot at = places_.take(rounded(count));
    for (Slot k = 0; k < count; ++k) at_[step.items[k]] = at + k;
    add({op, at, count, static_cast<Slot>(tape_.operands_.size()), 0, 0});
    for (std::size_t k = 0; k < static_cast<std::size_t>(info(op).arity); ++k)
      for (Slot i : step.items) tape_.operands_.push_back(place(items_[i].reads[k]));
  }

  void emit_linear(Slot i) {
    const Instruction& code = p_.instructions[instruction_[i]];
    const bool factor = code.part == Part::factor;
    const Slot result = at_[i] = places_.take(rounded(static_cast<Slot>(code.results())));
    add({Op::solve, result, 1, static_cast<Slot>(tape_.linear_.size()), 0, 0});
    std::vector<Slot> operands;
    for (Slot k = 0; k < static_cast<Slot>(code.extras()); ++k) operands.push_back(place(items_[i].reads[k]));
    const std::vector<Copy> copies = arrange_copies(operands, static_cast<Slot>(p_.inputs));
    tape_.linear_.push_back({factor, code.size, code.band, static_cast<Slot>(tape_.linear_copies_.size()),
                             static_cast<Slot>(copies.size()),
                             factor ? result : place(items_[i].reads.back()), code.transposed});
    tape_.linear_copies_.insert(tape_.linear_copies_.end(), copies.begin(), copies.end());
  }

  /// Loops come before the operations of a run.
  void add(const Run& run) {
    tape_.runs_.push_back(run);
    tape_.runs_.back().first_loop = loops_used_;
    tape_.runs_.back().loops = static_cast<Slot>(tape_.loops_.size()) - loops_used_;
    loops_used_ = static_cast<Slot>(tape_.loops_.size());
  }

  void emit_loop(const Step& step) {
    Loop loop;
    std::vector<Slot> last(step.items.size());  // strand that reads a local result last
    std::map<Slot, std::size_t> strand;         // by item
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      const Slot i = step.items[k];
      strand[i] = last[k] = k;
      for (Slot slot : items_[i].piece.operand)
        if (const auto from = strand.find(owner_[slot]); from != strand.end()) last[from->second] = k;
    }
    std::vector<Slot> buffer(step.items.size()), vacant;
    Slot buffers = 0;
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      if (!timing_.local[step.items[k]]) continue;
      if (vacant.empty()) vacant.push_back(buffers++);
      buffer[k] = vacant.back(), vacant.pop_back();
      for (std::size_t j = 0; j <= k; ++j)
        if (last[j] == k && timing_.local[step.items[j]]) vacant.push_back(buffer[j]);
    }
    constexpr Slot cached = 2048, fewest = 64, most = 512;  // numbers in all buffers, members in a chunk
    for (Slot i : step.items) loop.steps = std::max(loop.steps, items_[i].piece.count + timing_.shift[i]);
    loop.chunk = std::clamp(cached / std::max(buffers, 1U) / 64 * 64, fewest, most);
    loop.chunk = std::min(loop.chunk, rounded(loop.steps));
    const Slot base = places_.take(buffers * loop.chunk);
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      const Slot i = step.items[k];
      const Item& item = items_[i];
      Strand s{item.piece, timing_.shift[i], timing_.local[i] != 0};
      if (!s.local_result) at_[i] = places_.take(rounded(item.size));
      s.piece.result = s.local_result ? base + buffer[k] * loop.chunk : at_[i];
      for (int o = 0; o < 2; ++o) {
        const Slot from = owner_[item.piece.operand[o]];
        s.local_operand[o] = from != no_owner && timing_.local[from];
        s.piece.operand[o] =
            s.local_operand[o] ? base + buffer[strand.at(from)] * loop.chunk : place(item.piece.operand[o]);
      }
      loop.strands.push_back(s);
    }
    if (buffers == 0 && step.items.size() == 1) loop.chunk = loop.steps;
    places_.give(base, buffers * loop.chunk);
    tape_.loops_.push_back(std::move(loop));
  }

  /// Inputs that are read from the workspace: those of operations without pattern.
  void find_used_inputs() {
    std::vector<char> used(p_.inputs, 0);
    for (Slot slot : tape_.operands_)
      if (slot < p_.inputs) used[slot] = 1;
    constexpr std::size_t near = 16;  // copied along
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      auto& ranges = tape_.used_inputs_;
      if (ranges.empty() || i > ranges.back().second + near) ranges.emplace_back(i, i);
      ranges.back().second = i + 1;
    }
  }

  const Program& p_;
  Tape& tape_;
  Slot first_, next_, loops_used_ = 0;
  Workspace places_;
  std::vector<Slot> slot_;   ///< of every value, before places are used again
  std::vector<Slot> owner_;  ///< of every slot
  std::vector<Item> items_;
  std::vector<Slot> instruction_;  ///< of every item, the first
  Timing timing_;
  std::vector<Step> steps_;
  std::vector<Slot> step_of_, at_;                         ///< of every item; at_: in the workspace
  std::vector<std::vector<std::pair<Slot, Slot>>> dying_;  ///< first item and size
};

Tape::Tape(const Program& low) : input_count_(low.inputs), constants_(low.constants) { Layout(low, *this); }

}  // namespace pendula::codegen
