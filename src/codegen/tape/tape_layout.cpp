// The second half of the translation of a program to a tape: loops that can run together are fused, items are
// assigned to steps, and results get places in the workspace until their last use.
#include <algorithm>
#include <map>
#include <numeric>

#include "codegen/tape/tape.hpp"
#include "codegen/tape/tape_items.hpp"

namespace pendula::codegen {
namespace {

Slot rounded(Slot size) { return (size + 7) / 8 * 8; }  // aligns loops to cache lines

/// Items that run together: a fused loop, or irregular operations of one kind, or a linear system.
struct Step {
  std::vector<Slot> items;
};

struct Steps {
  std::vector<Step> list;
  std::vector<Slot> of;  ///< of every item
};

/// Orders the items by time and loop; adjacent items of one kind form a step.
class StepMaker {
 public:
  StepMaker(const Program& program, const TapeItems& made, const Timing& timing)
      : p_(program), made_(made), timing_(timing) {}

  Steps make() && {
    std::vector<Slot> order(made_.items.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto rank = [&](Slot i) {
      return std::pair(timing_.time[i], made_.items[i].is_loop ? timing_.loop[i] : 0);
    };
    std::stable_sort(order.begin(), order.end(), [&](Slot i, Slot j) { return rank(i) < rank(j); });
    steps_.of.resize(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const Slot i = order[k];
      if (k == 0 || rank(i) != rank(order[k - 1]) || !same_kind(i, order[k - 1])) steps_.list.emplace_back();
      steps_.list.back().items.push_back(i);
      steps_.of[i] = static_cast<Slot>(steps_.list.size() - 1);
    }
    return std::move(steps_);
  }

 private:
  /// Items of one loop, or independent items of one operation.
  bool same_kind(Slot i, Slot j) const {
    if (made_.items[i].is_loop) return true;
    const Op op = p_.instructions[made_.instruction[i]].op;
    if (op == Op::solve || op != p_.instructions[made_.instruction[j]].op) return false;
    for (Slot slot : made_.items[i].reads)
      if (const Slot from = made_.owner[slot]; from != no_owner && step_open(from)) return false;
    return true;
  }
  bool step_open(Slot item) const {
    return !made_.items[item].is_loop && !steps_.list.empty() && steps_.of[item] == steps_.list.size() - 1 &&
           timing_.time[item] == timing_.time[steps_.list.back().items.back()];
  }

  const Program& p_;
  const TapeItems& made_;
  const Timing& timing_;
  Steps steps_;
};

/// First slot and size of a range that is no longer read.
using Dead = std::pair<Slot, Slot>;

/// dead[s]: ranges that are not read after step s. Results of linear systems are kept.
std::vector<std::vector<Dead>> dead_after(const Program& p, const TapeItems& made, const Timing& timing,
                                          const Steps& steps, const std::vector<Slot>& results) {
  std::vector<Slot> last(steps.of);
  const auto use = [&](Slot slot, Slot step) {
    if (const Slot from = made.owner[slot]; from != no_owner) last[from] = std::max(last[from], step);
  };
  for (std::size_t i = 0; i < made.items.size(); ++i) {
    for (Slot slot : made.items[i].reads) use(slot, steps.of[i]);
    if (made.items[i].is_loop)
      for (Slot slot : made.items[i].loop.operand) use(slot, steps.of[i]);
  }
  for (Slot slot : results) use(slot, static_cast<Slot>(steps.list.size()));
  std::vector<std::vector<Dead>> dead(steps.list.size() + 1);
  for (const Step& step : steps.list) {
    const Slot first = step.items[0];
    if (made.is_linear(p, first)) continue;
    if (!made.items[first].is_loop) {  // together
      Slot end = 0;
      for (Slot i : step.items) end = std::max(end, last[i]);
      dead[end].push_back({first, rounded(static_cast<Slot>(step.items.size()))});
    } else {
      for (Slot i : step.items)
        if (!timing.local[i]) dead[last[i]].push_back({i, rounded(made.items[i].size)});
    }
  }
  return dead;
}

}  // namespace

/// Allocates places in the workspace. The place freed last is reused first, while it is still in the cache.
class Workspace {
 public:
  explicit Workspace(Slot first) : end_(first) {}
  Slot take(Slot size) {
    for (std::size_t k = free_.size(); k-- > 0;) {
      if (free_[k].size < size) continue;
      const Slot at = free_[k].at;
      free_[k].at += size;
      free_[k].size -= size;
      if (free_[k].size == 0) free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(k));
      return at;
    }
    const Slot at = end_;
    end_ += size;
    return at;
  }
  void give(Slot at, Slot size) {
    for (std::size_t k = 0; k < free_.size(); ++k) {  // merges it with its neighbours
      FreeBlock& hole = free_[k];
      if (hole.at + hole.size != at && at + size != hole.at) continue;
      at = std::min(at, hole.at);
      size += hole.size;
      free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(k));
      k = static_cast<std::size_t>(-1);
    }
    free_.push_back({at, size});
    constexpr std::size_t many = 64;  // small gaps are dropped
    if (free_.size() > many)
      free_.erase(std::min_element(free_.begin(), free_.end(),
                                   [](const FreeBlock& p, const FreeBlock& q) { return p.size < q.size; }));
  }
  Slot end() const { return end_; }

 private:
  struct FreeBlock {
    Slot at, size;
  };
  std::vector<FreeBlock> free_;
  Slot end_;
};

/// Writes the steps to the tape in order and assigns places to results.
class Tape::Emitter {
 public:
  Emitter(const Program& program, const TapeItems& made, const Timing& timing, Tape& tape)
      : p_(program),
        made_(made),
        timing_(timing),
        tape_(tape),
        places_(rounded(program.first_instruction() + gap)),
        at_(made.items.size()) {}

  void emit(const Step& step, const std::vector<Dead>& dead) {
    if (made_.items[step.items[0]].is_loop)
      emit_loop(step);
    else if (made_.is_linear(p_, step.items[0]))
      emit_linear(step.items[0]);
    else
      emit_run(step);
    for (const auto& [first, size] : dead) places_.give(at_[first], size);
  }

  void finish(std::vector<Slot> results) {
    for (Slot& slot : results) slot = place(slot);
    tape_.output_count_ = results.size();
    tape_.copies_ = arrange_copies(results, static_cast<Slot>(p_.inputs));
    tape_.slots_ = places_.end();
    find_used_inputs();
  }

 private:
  Slot place(Slot slot) const {
    const Slot from = made_.owner[slot];
    return from == no_owner ? slot : at_[from] + (slot - made_.items[from].result);
  }

  void emit_run(const Step& step) {
    const Op op = p_.instructions[made_.instruction[step.items[0]]].op;
    const auto count = static_cast<Slot>(step.items.size());
    const Slot at = places_.take(rounded(count));
    for (Slot k = 0; k < count; ++k) at_[step.items[k]] = at + k;
    add({op, at, count, static_cast<Slot>(tape_.operands_.size()), 0, 0});
    for (std::size_t k = 0; k < static_cast<std::size_t>(info(op).arity); ++k)
      for (Slot i : step.items) tape_.operands_.push_back(place(made_.items[i].reads[k]));
  }

  void emit_linear(Slot i) {
    const Instruction& code = p_.instructions[made_.instruction[i]];
    const bool factor = code.part == Part::factor;
    const Slot result = at_[i] = places_.take(rounded(static_cast<Slot>(code.results())));
    add({Op::solve, result, 1, static_cast<Slot>(tape_.linear_.size()), 0, 0});
    std::vector<Slot> operands;
    for (Slot k = 0; k < static_cast<Slot>(code.extras()); ++k)
      operands.push_back(place(made_.items[i].reads[k]));
    const std::vector<Copy> copies = arrange_copies(operands, static_cast<Slot>(p_.inputs));
    tape_.linear_.push_back({factor, code.size, code.band, static_cast<Slot>(tape_.linear_copies_.size()),
                             static_cast<Slot>(copies.size()),
                             factor ? result : place(made_.items[i].reads.back()), code.transposed});
    tape_.linear_copies_.insert(tape_.linear_copies_.end(), copies.begin(), copies.end());
  }

  /// The loops of a run precede its operations.
  void add(const Run& run) {
    tape_.runs_.push_back(run);
    tape_.runs_.back().first_loop = loops_used_;
    tape_.runs_.back().loops = static_cast<Slot>(tape_.loops_.size()) - loops_used_;
    loops_used_ = static_cast<Slot>(tape_.loops_.size());
  }

  void emit_loop(const Step& step) {
    FusedLoop loop;
    std::vector<Slot> last(step.items.size());  // last strand that reads a local result
    std::map<Slot, std::size_t> strand;         // by item
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      const Slot i = step.items[k];
      strand[i] = last[k] = k;
      for (Slot slot : made_.items[i].loop.operand)
        if (const auto from = strand.find(made_.owner[slot]); from != strand.end()) last[from->second] = k;
    }
    std::vector<Slot> buffer(step.items.size()), vacant;
    Slot buffers = 0;
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      if (!timing_.local[step.items[k]]) continue;
      if (vacant.empty()) vacant.push_back(buffers++);
      buffer[k] = vacant.back();
      vacant.pop_back();
      for (std::size_t j = 0; j <= k; ++j)
        if (last[j] == k && timing_.local[step.items[j]]) vacant.push_back(buffer[j]);
    }
    constexpr Slot cached = 2048, fewest = 64, most = 512;  // numbers in all buffers, members in a chunk
    for (Slot i : step.items) loop.steps = std::max(loop.steps, made_.items[i].loop.count + timing_.shift[i]);
    loop.chunk = std::clamp(cached / std::max(buffers, 1U) / 64 * 64, fewest, most);
    loop.chunk = std::min(loop.chunk, rounded(loop.steps));
    const Slot base = places_.take(buffers * loop.chunk);
    for (std::size_t k = 0; k < step.items.size(); ++k) {
      const Slot i = step.items[k];
      const Item& item = made_.items[i];
      FusedOperation s{item.loop, timing_.shift[i], timing_.local[i] != 0};
      if (!s.local_result) at_[i] = places_.take(rounded(item.size));
      s.loop.result = s.local_result ? base + buffer[k] * loop.chunk : at_[i];
      for (int o = 0; o < 2; ++o) {
        const Slot from = made_.owner[item.loop.operand[o]];
        s.local_operand[o] = from != no_owner && timing_.local[from];
        s.loop.operand[o] =
            s.local_operand[o] ? base + buffer[strand.at(from)] * loop.chunk : place(item.loop.operand[o]);
      }
      loop.operations.push_back(s);
    }
    if (buffers == 0 && step.items.size() == 1) loop.chunk = loop.steps;
    places_.give(base, buffers * loop.chunk);
    tape_.loops_.push_back(std::move(loop));
  }

  /// Finds the inputs that are read from the workspace by irregular operations.
  void find_used_inputs() {
    std::vector<char> used(p_.inputs, 0);
    for (Slot slot : tape_.operands_)
      if (slot < p_.inputs) used[slot] = 1;
    constexpr std::size_t near = 16;  // gaps up to this size are copied, too
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      auto& ranges = tape_.used_inputs_;
      if (ranges.empty() || i > ranges.back().second + near) ranges.emplace_back(i, i);
      ranges.back().second = i + 1;
    }
  }

  const Program& p_;
  const TapeItems& made_;
  const Timing& timing_;
  Tape& tape_;
  Slot loops_used_ = 0;
  Workspace places_;
  std::vector<Slot> at_;  ///< of every item: its place in the workspace
};

Tape::Tape(const Program& program) : input_count_(program.inputs), constants_(program.constants) {
  const TapeItems made = items_of(program, gap);
  std::vector<Slot> results;
  for (Slot value : program.results) results.push_back(made.slot[value]);
  const Timing timing = fuse(made.items, made.owner, results);
  const Steps steps = StepMaker(program, made, timing).make();
  const auto dead = dead_after(program, made, timing, steps, results);
  Emitter emitter(program, made, timing, *this);
  for (std::size_t s = 0; s < steps.list.size(); ++s) emitter.emit(steps.list[s], dead[s]);
  emitter.finish(std::move(results));
  regular_ = made.in_loops;
}

}  // namespace pendula::codegen
