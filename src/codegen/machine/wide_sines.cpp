#include "codegen/machine/wide_sines.hpp"

#include <algorithm>
#include <unordered_map>

#include "codegen/machine/registers.hpp"

namespace pendula::codegen {
namespace {

constexpr Slot width = Instruction::width;
constexpr Slot nothing = Program::elsewhere;

bool is_sine(const Instruction& i) {
  return i.part == Part::none && !i.wide && (i.op == Op::sin || i.op == Op::cos);
}

class Gathering {
 public:
  explicit Gathering(const Program& program)
      : p_(program), first_(program.first_instruction()), order_(call_order(program)) {
    place_.assign(first_ + p_.instructions.size(), nothing);
    for (Slot v = 0; v < first_; ++v) place_[v] = v;
    out_.inputs = p_.inputs;
    out_.constants = p_.constants;
  }

  Program result() && {
    for (std::size_t at = 0; at < order_.size(); ++at) {
      const Slot v = first_ + order_[at];
      if (place_[v] == nothing && is_sine(p_.of(v))) gather_from(at);
      if (place_[v] == nothing) copy(v);
    }
    for (Slot v : p_.results) out_.results.push_back(v == nothing ? nothing : place_[v]);
    for (const auto& [v, first] : p_.wide_results) out_.wide_results.push_back({place_[v], first});
    return std::move(out_);
  }

 private:
  struct Lane {
    Slot sin, cos, which;
  };

  Slot put(const Instruction& i) {
    out_.instructions.push_back(i);
    return out_.first_instruction() + static_cast<Slot>(out_.instructions.size()) - 1;
  }

  void copy(Slot v) {
    Instruction i = p_.of(v);
    for (int k = 0; k < i.operands(); ++k) i.operand[k] = place_[i.operand[k]];
    const auto extra = static_cast<Slot>(out_.extra.size());
    for (int k = 0; k < i.extras(); ++k)
      out_.extra.push_back(place_[p_.extra[i.first_extra + static_cast<Slot>(k)]]);
    i.first_extra = extra;
    place_[v] = put(i);
  }

  /// Consecutive calls in the order, from a position on, that are sines of known angles.
  std::vector<Slot> ready_sines(std::size_t at) const {
    std::vector<Slot> list;
    for (; at < order_.size() && is_call(p_.instructions[order_[at]]); ++at) {
      const Slot v = first_ + order_[at];
      if (place_[v] == nothing && is_sine(p_.of(v)) && place_[p_.of(v).operand[0]] != nothing)
        list.push_back(v);
    }
    return list;
  }

  void gather_from(std::size_t at) {
    const std::vector<Slot> sines = ready_sines(at);
    std::vector<Slot> angles;
    std::unordered_map<Slot, Lane> lanes;
    for (Slot v : sines)
      if (lanes.try_emplace(p_.of(v).operand[0]).second) angles.push_back(p_.of(v).operand[0]);
    for (std::size_t k = 0; k < angles.size(); k += width) {
      const Slot count = std::min<Slot>(width, static_cast<Slot>(angles.size() - k));
      if (count == 1) {
        lanes.erase(angles[k]);
        break;
      }
      const auto extra = static_cast<Slot>(out_.extra.size());
      for (Slot l = 0; l < width; ++l) out_.extra.push_back(place_[angles[k + std::min(l, count - 1)]]);
      const Slot wide = put({.op = Op::add, .part = Part::gather, .wide = true, .first_extra = extra});
      const Slot sin = put({.op = Op::sin, .wide = true, .operand = {wide, 0, 0}});
      const Slot cos = put({.op = Op::cos, .wide = true, .operand = {wide, 0, 0}});
      for (Slot l = 0; l < count; ++l) lanes[angles[k + l]] = {sin, cos, l};
    }
    for (Slot v : sines) {
      const auto lane = lanes.find(p_.of(v).operand[0]);
      if (lane == lanes.end()) continue;
      const auto& [sin, cos, which] = lane->second;
      const Slot wide = p_.of(v).op == Op::sin ? sin : cos;
      place_[v] = put({.op = Op::solve, .part = Part::component, .operand = {wide, which, 0}});
    }
  }

  const Program& p_;
  Slot first_;
  std::vector<Slot> order_, place_;
  Program out_;
};

}  // namespace

Program with_wide_sines(const Program& program) {
  std::unordered_map<Slot, char> angles;
  for (const Instruction& i : program.instructions)
    if (is_sine(i)) angles.try_emplace(i.operand[0]);
  return angles.size() < 2 ? program : Gathering(program).result();
}

}  // namespace pendula::codegen
