#include "codegen/program/contract.hpp"

#include <optional>
#include <unordered_map>

namespace pendula::codegen {
namespace {

/// Replaces divisions, which are slow, by multiplications if a divisor is constant or occurs several times.
class Reciprocals {
 public:
  explicit Reciprocals(const Program& program) : p_(program) {
    out_.inputs = p_.inputs;
    out_.constants = p_.constants;
    for (const Instruction& i : p_.instructions)
      if (is_division(i)) ++divided_[i.operand[1]];
    one_ = constant(1);
    for (const auto& [value, count] : divided_)
      if (is_constant(value)) reciprocal_[value] = constant(1 / p_.constants[value - p_.inputs]);
    here_.resize(p_.first_instruction() + p_.instructions.size());
    for (Slot v = 0; v < p_.first_instruction(); ++v) here_[v] = v;
  }

  Program result() && {
    for (std::size_t k = 0; k < p_.instructions.size(); ++k) {
      Instruction i = p_.instructions[k];
      const bool replaced = is_division(i) && (is_constant(i.operand[1]) || divided_[i.operand[1]] > 1);
      const Slot factor = replaced ? reciprocal(i.operand[1]) : 0;
      for (int o = 0; o < i.operands(); ++o) {
        Slot& value = i.operand[o];
        value = here_[value];
      }
      const auto first = static_cast<Slot>(out_.extra.size());
      for (int e = 0; e < i.extras(); ++e)
        out_.extra.push_back(here_[p_.extra[i.first_extra + static_cast<Slot>(e)]]);
      i.first_extra = first;
      if (replaced) {
        i.op = Op::mul;
        i.operand[1] = factor;
      }
      here_[p_.first_instruction() + k] = put(i);
    }
    for (Slot v : p_.results) out_.results.push_back(here_[v]);
    return std::move(out_);
  }

 private:
  static bool is_division(const Instruction& i) { return i.part == Part::none && i.op == Op::div; }
  bool is_constant(Slot value) const { return value >= p_.inputs && value < p_.first_instruction(); }
  Slot constant(double value) {
    out_.constants.push_back(value);
    return out_.first_instruction() - 1;
  }
  Slot put(const Instruction& i) {
    out_.instructions.push_back(i);
    return out_.first_instruction() + static_cast<Slot>(out_.instructions.size()) - 1;
  }
  Slot reciprocal(Slot value) {
    const auto [at, made] = reciprocal_.try_emplace(value, 0);
    if (made) at->second = put({.op = Op::div, .operand = {one_, here_[value], 0}});
    return at->second;
  }

  const Program& p_;
  Program out_;
  std::unordered_map<Slot, int> divided_;
  std::unordered_map<Slot, Slot> reciprocal_;
  std::vector<Slot> here_;
  Slot one_ = 0;
};

class Contraction {
 public:
  explicit Contraction(const Program& program)
      : p_(program), uses_(program.first_instruction() + program.instructions.size(), 0) {
    for (const Instruction& i : p_.instructions) p_.each_operand(i, [&](Slot v) { ++uses_[v]; });
    for (Slot v : p_.results) ++uses_[v];
    removed_.assign(p_.instructions.size(), false);
    for (const Instruction& i : p_.instructions) fused_.push_back(fused(i));
  }

  Program result() const {
    Program out;
    out.inputs = p_.inputs;
    out.constants = p_.constants;
    std::vector<Slot> here(uses_.size());
    for (Slot v = 0; v < p_.first_instruction(); ++v) here[v] = v;
    for (std::size_t k = 0; k < p_.instructions.size(); ++k) {
      if (removed_[k]) continue;
      Instruction i = fused_[k].value_or(p_.instructions[k]);
      for (int o = 0; o < i.operands(); ++o) {
        Slot& value = i.operand[o];
        value = here[value];
      }
      const auto first = static_cast<Slot>(out.extra.size());
      for (int e = 0; e < i.extras(); ++e)
        out.extra.push_back(here[p_.extra[i.first_extra + static_cast<Slot>(e)]]);
      i.first_extra = first;
      here[p_.first_instruction() + k] = out.first_instruction() + static_cast<Slot>(out.instructions.size());
      out.instructions.push_back(i);
    }
    for (Slot v : p_.results) out.results.push_back(here[v]);
    return out;
  }

 private:
  /// A product that is used once and has not been fused yet.
  const Instruction* product(Slot value) const {
    if (value < p_.first_instruction() || uses_[value] != 1) return nullptr;
    const Instruction& i = p_.of(value);
    return i.part == Part::none && i.op == Op::mul ? &i : nullptr;
  }

  std::optional<Instruction> fused(const Instruction& i) {
    if (i.part != Part::none || (i.op != Op::add && i.op != Op::sub)) return {};
    const Slot x = i.operand[0], y = i.operand[1];
    Instruction result{.op = i.op, .part = Part::fused};
    if (const Instruction* by = product(y)) {
      if (i.op == Op::sub) result.op = Op::neg;  // x - a·b
      result.operand = {by->operand[0], by->operand[1], x};
      removed_[y - p_.first_instruction()] = true;
    } else if (const Instruction* ax = product(x)) {
      result.operand = {ax->operand[0], ax->operand[1], y};
      removed_[x - p_.first_instruction()] = true;
    } else {
      return {};
    }
    return result;
  }

  const Program& p_;
  std::vector<Slot> uses_;
  std::vector<bool> removed_;
  std::vector<std::optional<Instruction>> fused_;
};

}  // namespace

Program with_shared_reciprocals(const Program& program) { return Reciprocals(program).result(); }
Program contracted(const Program& program) { return Contraction(with_shared_reciprocals(program)).result(); }

}  // namespace pendula::codegen
