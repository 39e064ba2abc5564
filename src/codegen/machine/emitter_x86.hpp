// Writes the machine code of one program: which value is in which register, and the instructions of every
// operation. Internal to the machine for x86-64; asmjit is known here and in the files that include this.
#pragma once

#include <algorithm>
#include <unordered_map>

#include <asmjit/x86.h>

#include "codegen/machine/isa_x86.hpp"
#include "codegen/machine/registers.hpp"

namespace pendula::codegen {

using asmjit::Operand;

/// Emits one program. The last two registers, A_ and B_, are scratch, the others hold values.
class Emitter {
 public:
  Emitter(const Program& program, const Isa& isa, asmjit::CodeHolder& code);
  void emit_all();

  std::size_t work_numbers() const {
    return r_.work_size() * static_cast<std::size_t>(isa_.lanes) + (wide_values_ ? Instruction::width : 0);
  }

 private:
  // ── memory and registers ──
  x86::Vec reg(int r) const { return reg(r, *now_); }
  static x86::Vec reg(int r, const Isa& isa) {
    const auto id = static_cast<std::uint32_t>(r);
    return isa.lanes == 8   ? x86::Vec(x86::zmm(id))
           : isa.lanes == 4 ? x86::Vec(x86::ymm(id))
                            : x86::Vec(x86::xmm(id));
  }
  x86::Mem at(Home home) const { return at(home, *now_); }
  /// Wide values of code for one point take as many numbers as they have.
  x86::Mem at(Home home, const Isa& isa) const {
    const auto offset = static_cast<std::int32_t>(home.index) * 8 * isa_.lanes;
    const auto size = static_cast<std::uint32_t>(8 * isa.lanes);
    switch (home.array) {
      case Home::Array::input:
        return x86::ptr(x86::rbx, offset, size);
      case Home::Array::output:
        return x86::ptr(x86::r12, offset, size);
      case Home::Array::work:
        return x86::ptr(x86::r13, offset, size);
      default:
        return x86::ptr(constants_, constant_offset(home.index), size);
    }
  }
  /// The pool: sign, absolute value, one and zero, 64 bytes each; then the constants of the program.
  enum Mask { sign_bit, all_but_sign, one, zero };
  static constexpr int mask_numbers = 8;
  std::int32_t constant_offset(Slot i) const {
    return 4 * 8 * mask_numbers + static_cast<std::int32_t>(i) * 8 * isa_.lanes;
  }
  x86::Mem mask(Mask m) const {
    return x86::ptr(constants_, 8 * mask_numbers * m,
                    static_cast<std::uint32_t>(std::max(2, now_->lanes) * 8));
  }
  const Isa& isa_of(Slot value) const { return r_.is_wide(value) ? avx4 : isa_; }

  void load(int r, Slot value);
  void keep(int r);           ///< gives the value of a register a home
  int take(unsigned pinned);  ///< a register for a new value
  int in_register(Slot value, unsigned& pinned);
  Operand operand(Slot value) {
    const int r = r_.of(value);
    return r >= 0 ? Operand(reg(r)) : Operand(at(r_.home(value)));
  }

  // ── operations ──
  /// d = a op b; d may be the register of a. In SSE code d must not be that of b.
  void three(x86::Inst::Id op, int d, int a, const Operand& b);
  void compare(int d, int a, const Operand& b, unsigned predicate);
  Operand zero_number() const {
    return x86::ptr(constants_, 8 * mask_numbers * zero, static_cast<std::uint32_t>(8 * now_->lanes));
  }

  // Each leaves its result in the register that it returns; instructions_x86.cpp.
  int emit_operation(const Instruction& i);
  int emit_arithmetic(const Instruction& i);
  int emit_logic(const Instruction& i);
  int emit_choice(const Instruction& i, int ra, int rb, int rc);
  int emit_fused(const Instruction& i);
  int emit_gather(const Instruction& i);
  void insert_pair(int r, Slot low, Slot high);

  void emit(Slot value, const Instruction& i);
  void emit_call(Slot value, const Instruction& i);
  void emit_pair(Slot value, Slot partner, const Instruction& i);
  void emit_linear(Slot value, const Instruction& i);
  void emit_component(Slot value, const Instruction& i);
  void pair_functions();
  void finish(Slot value, int r);
  void leave_registers();
  void call(const void* function);
  void copy_leaf_results();
  void embed_constants();
  void result_positions();
  void consume(const Instruction& i) {
    p_.each_operand(i, [&](Slot v) { r_.used(v); });
  }

  const Program& p_;
  const Isa& isa_;
  const Isa* now_;          ///< of the instruction in hand
  const bool wide_values_;  ///< the program has wide instructions
  const int values_, A_, B_;
  x86::Assembler a_;
  std::vector<Slot> order_;
  Registers r_;
  asmjit::Label constants_;
  std::unordered_map<Slot, Slot> partner_;  ///< of sin(a) and cos(a): the one that comes later
  std::vector<Slot> outputs_, outputs_of_;  ///< positions of outputs, value by value
  std::unordered_multimap<Slot, Slot> wide_outputs_;
};

}  // namespace pendula::codegen
