// The order of the instructions, the values in registers and in memory, calls of functions.
#ifdef PENDULA_MACHINE_CODE
#include "codegen/machine/emitter_x86.hpp"

#include <cstring>

#include "codegen/machine/functions.hpp"
#include "codegen/routines/sines.hpp"
#include "expr/graph/operation.hpp"

namespace pendula::codegen {

using namespace asmjit;

Emitter::Emitter(const Program& program, const Isa& isa, CodeHolder& code)
    : p_(program),
      isa_(isa),
      now_(&isa),
      wide_values_(std::any_of(program.instructions.begin(), program.instructions.end(),
                               [](const Instruction& i) { return i.wide; })),
      values_(isa.lanes == 8 ? 30 : 14),
      A_(values_),
      B_(values_ + 1),
      a_(&code),
      order_(call_order(program)),
      r_(program, order_, values_) {
  constants_ = a_.newLabel();
  result_positions();
  if (isa_.lanes == 1) pair_functions();
}

void Emitter::emit_all() {
  a_.push(x86::rbx);
  a_.push(x86::r12);
  a_.push(x86::r13);
  a_.mov(x86::rbx, x86::rdi);
  a_.mov(x86::r12, x86::rsi);
  a_.mov(x86::r13, x86::rdx);
  if (wide_values_) {  // aligns wide slots to cache lines
    a_.add(x86::r13, 8 * Instruction::width - 1);
    a_.and_(x86::r13, -8 * Instruction::width);
  }
  copy_leaf_results();
  for (Slot i : order_) emit(p_.first_instruction() + i, p_.instructions[i]);
  if (isa_.lanes > 1 || wide_values_) a_.vzeroupper();
  a_.pop(x86::r13);
  a_.pop(x86::r12);
  a_.pop(x86::rbx);
  a_.ret();
  embed_constants();
}

// ── registers ──────────────────────────────────────────────────────────────────────────────────────────────

void Emitter::load(int r, Slot value) {
  const Isa& isa = isa_of(value);
  if (const int from = r_.of(value); from != Registers::in_memory) {
    if (from != r) a_.emit(isa.copy, reg(r, isa), reg(from, isa));
  } else {
    a_.emit(isa.load, reg(r, isa), at(r_.home(value), isa));
  }
}

void Emitter::keep(int r) {
  const Slot value = r_.in(r);
  Home& home = r_.home(value);
  if (home) return;
  const Isa& isa = isa_of(value);
  home = {Home::Array::work, r_.is_wide(value) ? r_.new_wide_slot() : r_.new_slot()};
  a_.emit(isa.store, at(home, isa), reg(r, isa));
}

int Emitter::take(unsigned pinned) {
  if (const auto r = r_.vacant()) return *r;
  const int r = r_.furthest(pinned);
  keep(r);
  r_.empty(r);
  return r;
}

int Emitter::in_register(Slot value, unsigned& pinned) {
  int r = r_.of(value);
  if (r < 0) {
    r = take(pinned);
    load(r, value);
    r_.assign(r, value);
  }
  pinned |= 1U << r;
  return r;
}

void Emitter::leave_registers() {
  for (int r = 0; r < values_; ++r) {
    if (r_.in(r) == Registers::never) continue;
    keep(r);
    r_.empty(r);
  }
}

// ── results and constants ──────────────────────────────────────────────────────────────────────────────────

void Emitter::result_positions() {
  outputs_of_.assign(p_.first_instruction() + p_.instructions.size() + 1, 0);
  for (const auto& [value, first] : p_.wide_results) wide_outputs_.emplace(value, first);
  for (Slot value : p_.results)
    if (value != Program::elsewhere) ++outputs_of_[value + 1];
  for (std::size_t i = 1; i < outputs_of_.size(); ++i) outputs_of_[i] += outputs_of_[i - 1];
  outputs_.resize(p_.results.size());
  std::vector<Slot> next(outputs_of_.begin(), outputs_of_.end() - 1);
  for (Slot k = 0; k < p_.results.size(); ++k)
    if (p_.results[k] != Program::elsewhere) outputs_[next[p_.results[k]]++] = k;
}

void Emitter::copy_leaf_results() {
  for (Slot k = 0; k < p_.results.size(); ++k) {
    const Slot value = p_.results[k];
    if (value >= p_.first_instruction()) continue;
    a_.emit(isa_.load, reg(B_), at(r_.home(value)));
    a_.emit(isa_.store, at({Home::Array::output, k}), reg(B_));
  }
}

void Emitter::embed_constants() {
  a_.align(AlignMode::kData, 64);
  a_.bind(constants_);
  const auto pool = [&](std::uint64_t bits, int count) {
    for (int k = 0; k < count; ++k) a_.embedUInt64(bits);
  };
  const auto bits = [](double x) {
    std::uint64_t b;
    std::memcpy(&b, &x, sizeof b);
    return b;
  };
  pool(std::uint64_t{1} << 63, mask_numbers);
  pool(~(std::uint64_t{1} << 63), mask_numbers);
  pool(bits(1.0), mask_numbers);
  pool(0, mask_numbers);
  for (double x : p_.constants) pool(bits(x), isa_.lanes);
}

/// Handles a result in register r: stores it to its outputs and keeps it if it is used again.
void Emitter::finish(Slot value, int r) {
  for (Slot k = outputs_of_[value]; k < outputs_of_[value + 1]; ++k) {
    const Home out{Home::Array::output, outputs_[k]};
    a_.emit(isa_.store, at(out), reg(r));
    r_.home(value) = out;
  }
  if (r_.is_wide(value)) {
    const auto [first, last] = wide_outputs_.equal_range(value);
    for (auto output = first; output != last; ++output) {
      const Home out{Home::Array::output, output->second};
      a_.emit(now_->store, at(out), reg(r));
      r_.home(value) = out;
    }
  }
  if (r_.alive(value)) r_.assign(r, value);
}

// ── calls ──────────────────────────────────────────────────────────────────────────────────────────────────

void Emitter::call(const void* function) {
  a_.mov(x86::rax, Imm(reinterpret_cast<std::uintptr_t>(function)));
  a_.call(x86::rax);
}

void Emitter::emit_call(Slot value, const Instruction& i) {
  // via the scratch registers: the arguments may be in each other's registers
  load(B_, i.operand[0]);
  if (i.operands() > 1) load(A_, i.operand[1]);
  consume(i);
  leave_registers();
  a_.emit(isa_.copy, reg(0), reg(B_));
  if (i.operands() > 1) a_.emit(isa_.copy, reg(1), reg(A_));
  if (wide_values_) a_.vzeroupper();
  call(isa_.lanes > 1 ? lane_function(i.op, isa_.lanes) : scalar_function(i.op));
  finish(value, 0);
}

/// Computes sine and cosine of one argument by one call.
void Emitter::pair_functions() {
  std::unordered_map<Slot, Slot> first;  // by argument
  for (Slot k : order_) {
    const Instruction& i = p_.instructions[k];
    if (i.part != Part::none || (i.op != Op::sin && i.op != Op::cos)) continue;
    const auto [at, made] = first.try_emplace(i.operand[0], k);
    if (made || p_.instructions[at->second].op == i.op) continue;
    const Slot earlier = p_.first_instruction() + at->second, later = p_.first_instruction() + k;
    partner_[earlier] = partner_[later] = later;
  }
}

void Emitter::emit_pair(Slot value, Slot partner, const Instruction& i) {
  if (partner == value) return consume(i);  // computed together with the first
  load(B_, i.operand[0]);
  consume(i);
  leave_registers();
  a_.emit(now_->copy, reg(0), reg(B_));
  const Slot sin = i.op == Op::sin ? value : partner, cos = i.op == Op::sin ? partner : value;
  if (i.wide) {  // components are read from memory
    for (Slot v : {sin, cos}) r_.home(v) = {Home::Array::work, r_.new_wide_slot()};
    a_.lea(x86::rdi, at(r_.home(sin)));
    a_.lea(x86::rsi, at(r_.home(cos)));
    return call(wide_sincos_function());
  }
  if (wide_values_) a_.vzeroupper();
  call(sincos_function());
  finish(sin, 0);
  finish(cos, 1);
}

void Emitter::emit_linear(Slot value, const Instruction& i) {
  const Slot region = r_.new_slot(i.results());
  Slot k = region;
  for (int e = 0; e < i.extras(); ++e) {
    load(B_, p_.extra[i.first_extra + static_cast<Slot>(e)]);
    a_.emit(isa_.store, at({Home::Array::work, k++}), reg(B_));
  }
  const Home factors = i.part == Part::solve ? r_.home(i.operand[0]) : Home{};
  consume(i);
  leave_registers();
  if (isa_.lanes > 1 || wide_values_) a_.vzeroupper();
  const Home result{Home::Array::work, region};
  a_.lea(x86::rdi, at(result));
  a_.mov(x86::esi, Imm(i.size));
  if (i.part == Part::factor) {
    a_.mov(x86::edx, Imm(i.band));
    call(i.band > 0 ? band_factor_function(isa_.lanes) : factor_function(isa_.lanes));
  } else {
    a_.lea(x86::rdx, at(factors));
    a_.mov(x86::ecx, Imm(i.band > 0 ? i.band : i.transposed ? 1 : 0));
    call(i.band > 0 ? band_solve_function(isa_.lanes) : solve_function(isa_.lanes));
  }
  r_.home(value) = result;
  if (i.part == Part::solve && outputs_of_[value] < outputs_of_[value + 1]) {
    a_.emit(isa_.load, reg(0), at(result));
    const Home home = result;
    finish(value, 0);
    r_.home(value) = home;  // the components are read from here
  }
}

void Emitter::emit_component(Slot value, const Instruction& i) {
  if (const int r = r_.of(i.operand[0]); r != Registers::in_memory && r_.is_wide(i.operand[0])) keep(r);
  Home home = r_.home(i.operand[0]);
  home.index += i.operand[1];
  r_.home(value) = home;
  consume(i);
  if (outputs_of_[value] == outputs_of_[value + 1]) return;
  a_.emit(isa_.load, reg(B_), at(home));
  for (Slot k = outputs_of_[value]; k < outputs_of_[value + 1]; ++k)
    a_.emit(isa_.store, at({Home::Array::output, outputs_[k]}), reg(B_));
}

void Emitter::emit(Slot value, const Instruction& i) {
  r_.next_instruction();
  now_ = i.wide ? &avx4 : &isa_;
  if (i.part == Part::factor || i.part == Part::solve) {
    emit_linear(value, i);
  } else if (i.part == Part::component) {
    emit_component(value, i);
  } else if (i.part == Part::fused) {
    finish(value, emit_fused(i));
  } else if (i.part == Part::gather) {
    finish(value, emit_gather(i));
  } else if (const auto pair = partner_.find(value); pair != partner_.end()) {
    emit_pair(value, pair->second, i);
  } else if (is_call(i)) {
    emit_call(value, i);
  } else {
    finish(value, emit_operation(i));
  }
}

}  // namespace pendula::codegen

#endif
