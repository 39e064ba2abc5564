#include "codegen/machine/registers.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "expr/graph/operation.hpp"

namespace pendula::codegen {

bool is_call(const Instruction& i) {
  if (i.part == Part::fused) return false;
  if (i.op == Op::solve) return i.part != Part::component;  // a linear system
  return code_kind(i.op) != CodeKind::direct;
}

std::vector<Slot> call_order(const Program& program) {
  constexpr Slot window = 512;
  const Slot first = program.first_instruction(), n = static_cast<Slot>(program.instructions.size());
  std::vector<Slot> order(n), depth(n, 0);
  std::iota(order.begin(), order.end(), 0);
  for (Slot begin = 0; begin < n; begin += window) {
    const Slot end = std::min(n, begin + window);
    for (Slot i = begin; i < end; ++i)
      program.each_operand(program.instructions[i], [&](Slot value) {
        if (value < first + begin) return;
        const Slot k = value - first;
        depth[i] = std::max(depth[i], depth[k] + is_call(program.instructions[k]));
      });
    std::stable_sort(order.begin() + begin, order.begin() + end, [&](Slot a, Slot b) {
      const auto rank = [&](Slot i) { return 2 * depth[i] + is_call(program.instructions[i]); };
      return rank(a) < rank(b);
    });
  }
  return order;
}

Registers::Registers(const Program& program, const std::vector<Slot>& order, int count)
    : value_(static_cast<std::size_t>(count), never) {
  const Slot first = program.first_instruction();
  const std::size_t n = first + program.instructions.size();
  register_.assign(n, in_memory);
  home_.resize(n);
  for (Slot v = 0; v < first; ++v)
    home_[v] = v < program.inputs ? Home{Home::Array::input, v}
                                  : Home{Home::Array::constant, static_cast<Slot>(v - program.inputs)};
  wide_.assign(n, 0);
  shared_.assign(n, 0);
  for (Slot v = first; v < n; ++v) {
    const Instruction& i = program.of(v);
    wide_[v] = i.wide;
    if (i.part == Part::component && program.of(i.operand[0]).wide) shared_[v] = shared_[i.operand[0]] = 1;
  }
  next_.assign(n + 1, 0);
  for (const Instruction& i : program.instructions) program.each_operand(i, [&](Slot v) { ++next_[v + 1]; });
  std::partial_sum(next_.begin(), next_.end(), next_.begin());
  last_.assign(next_.begin(), next_.end() - 1);
  uses_.resize(next_.back());
  for (Slot position = 0; position < order.size(); ++position)
    program.each_operand(program.instructions[order[position]],
                         [&](Slot v) { uses_[last_[v]++] = position; });
}

void Registers::used(Slot value) {
  if (++next_[value] == last_[value]) release(value);
}

void Registers::next_instruction() {
  free_slots_.insert(free_slots_.end(), freed_.begin(), freed_.end());
  freed_.clear();
  free_wide_.insert(free_wide_.end(), freed_wide_.begin(), freed_wide_.end());
  freed_wide_.clear();
}

void Registers::release(Slot value) {
  if (register_[value] != in_memory) empty(register_[value]);
  Home& home = home_[value];
  if (home.array == Home::Array::work && !shared_[value])
    (wide_[value] ? freed_wide_ : freed_).push_back(home.index);
  home = {};
}

void Registers::assign(int r, Slot value) {
  empty(r);
  register_[value] = r;
  value_[r] = value;
}

void Registers::empty(int r) {
  Slot& value = value_[r];
  if (value != never) register_[value] = in_memory;
  value = never;
}

std::optional<int> Registers::vacant() const {
  const auto r = std::find(value_.begin(), value_.end(), never);
  if (r == value_.end()) return {};
  return static_cast<int>(r - value_.begin());
}

int Registers::furthest(unsigned pinned) const {
  int best = -1;
  for (int r = 0; r < static_cast<int>(value_.size()); ++r) {
    if (pinned >> r & 1) continue;
    if (best < 0 || uses_[next_[in(r)]] > uses_[next_[in(best)]]) best = r;
  }
  return best;
}

Slot Registers::new_slot(int numbers) {
  if (numbers == 1 && !free_slots_.empty()) {
    const Slot slot = free_slots_.back();
    free_slots_.pop_back();
    return slot;
  }
  const Slot slot = work_;
  work_ += static_cast<Slot>(numbers);
  return slot;
}

Slot Registers::new_wide_slot() {
  if (!free_wide_.empty()) {
    const Slot slot = free_wide_.back();
    free_wide_.pop_back();
    return slot;
  }
  for (; work_ % Instruction::width != 0; ++work_) free_slots_.push_back(work_);
  work_ += Instruction::width;
  return work_ - Instruction::width;
}

}  // namespace pendula::codegen
