// Operations that are machine instructions.
#ifdef PENDULA_MACHINE_CODE
#include "base/error.hpp"
#include "codegen/machine/emitter_x86.hpp"
#include "expr/graph/operation.hpp"

namespace pendula::codegen {

using namespace asmjit;

namespace {

constexpr bool is_direct(CodeKind kind) { return kind == CodeKind::direct; }
constexpr int direct_operations = 0
#define OP(name, arity, style, parity, exact, code, ...) +is_direct(CodeKind::code)
#include "expr/ops.def"
#undef OP
    ;
static_assert(
    direct_operations == 15,
    "a row of ops.def is marked `direct`: emit_arithmetic or emit_logic must know its instructions");

/// Operations with a machine instruction of their own; the other direct ones consist of
/// comparisons and masks.
bool is_arithmetic(Op op) {
  switch (op) {
    case Op::neg:
    case Op::abs:
    case Op::sqrt:
    case Op::add:
    case Op::sub:
    case Op::mul:
    case Op::div:
    case Op::min:
    case Op::max:
      return true;
    default:
      return false;
  }
}

x86::Inst::Id binary_instruction(const Isa& isa, Op op) {
  switch (op) {
    case Op::add:
      return isa.add;
    case Op::sub:
      return isa.sub;
    case Op::mul:
      return isa.mul;
    case Op::div:
      return isa.div;
    case Op::min:
      return isa.min;
    case Op::max:
      return isa.max;
    default:
      internal_error(__FILE__, __LINE__, "an operation without machine instruction");
  }
}

}  // namespace

void Emitter::three(x86::Inst::Id op, int d, int a, const Operand& b) {
  if (now_->vex) {
    a_.emit(op, reg(d), reg(a), b);
    return;
  }
  if (d != a) a_.emit(now_->copy, reg(d), reg(a));
  a_.emit(op, reg(d), b);
}

void Emitter::compare(int d, int a, const Operand& b, unsigned predicate) {
  if (now_->lanes == 8) {
    a_.emit(now_->cmp, x86::k1, reg(a), b, Imm(predicate));
    a_.vpmovm2q(reg(d), x86::k1);
    return;
  }
  if (now_->vex) {
    a_.emit(now_->cmp, reg(d), reg(a), b, Imm(predicate));
    return;
  }
  if (d != a) a_.emit(now_->copy, reg(d), reg(a));
  a_.emit(now_->cmp, reg(d), b, Imm(predicate));
}

int Emitter::emit_arithmetic(const Instruction& i) {
  unsigned pinned = 0;
  const int arity = i.operands();
  Slot a = i.operand[0], b = arity > 1 ? i.operand[1] : a;
  const bool commutes = i.op == Op::add || i.op == Op::mul;
  if (commutes && r_.of(a) < 0 && r_.of(b) >= 0) std::swap(a, b);
  if (i.op == Op::sqrt) {
    const Operand from = operand(a);
    consume(i);
    const int d = take(from.isReg() ? 1U << from.as<x86::Vec>().id() : 0U);
    if (now_->vex && now_->lanes == 1) {
      // vsqrtsd takes the upper half from its second operand
      if (from.isReg())
        a_.emit(now_->sqrt, reg(d), from, from);
      else {
        a_.emit(now_->load, reg(A_), from);
        a_.emit(now_->sqrt, reg(d), reg(A_), reg(A_));
      }
    } else {
      a_.emit(now_->sqrt, reg(d), from);
    }
    return d;
  }
  const int ra = in_register(a, pinned);
  if (i.op == Op::neg || i.op == Op::abs) {
    consume(i);
    const int d = take(pinned);
    three(i.op == Op::neg ? now_->bxor : now_->band, d, ra, mask(i.op == Op::neg ? sign_bit : all_but_sign));
    return d;
  }
  const Operand ob = operand(b);
  if (ob.isReg()) pinned |= 1U << ob.as<x86::Vec>().id();
  const x86::Inst::Id op = binary_instruction(*now_, i.op);
  consume(i);
  // for two-operand instructions the first register becomes the result if its value is no longer needed
  int d = !now_->vex && r_.in(ra) == Registers::never ? ra : take(pinned);
  if (!now_->vex && d != ra && ob.isReg() && static_cast<int>(ob.as<x86::Vec>().id()) == d) {
    a_.emit(now_->copy, reg(B_), reg(d));  // the result would overwrite the second operand
    three(op, d, ra, reg(B_));
    return d;
  }
  three(op, d, ra, ob);
  return d;
}

/// ifelse by a blend instruction, if available.
int Emitter::emit_choice(const Instruction& i, int ra, int rb, int rc) {
  constexpr unsigned neq = 4;
  if (now_->lanes == 8) {
    a_.emit(now_->cmp, x86::k1, reg(ra), zero_number(), Imm(neq));
    consume(i);
    const int d = take(0);
    a_.k(x86::k1).vblendmpd(reg(d), reg(rc), reg(rb));
    return d;
  }
  compare(A_, ra, zero_number(), neq);
  consume(i);
  const int d = take(0);
  a_.vblendvpd(reg(d), reg(rc), reg(rb), reg(A_));
  return d;
}

int Emitter::emit_logic(const Instruction& i) {
  constexpr unsigned lt = 1, le = 2, neq = 4;
  unsigned pinned = 0;
  const int ra = in_register(i.operand[0], pinned);
  const int rb = i.operands() > 1 ? in_register(i.operand[1], pinned) : ra;
  const int rc = i.operands() > 2 ? in_register(i.operand[2], pinned) : ra;
  switch (i.op) {
    case Op::lt:
    case Op::le:
      compare(A_, ra, reg(rb), i.op == Op::lt ? lt : le);
      three(now_->band, A_, A_, mask(one));
      break;
    case Op::both:
    case Op::either:
      compare(A_, ra, zero_number(), neq);
      compare(B_, rb, zero_number(), neq);
      three(i.op == Op::both ? now_->band : now_->bor, A_, A_, reg(B_));
      three(now_->band, A_, A_, mask(one));
      break;
    case Op::sign:
      a_.emit(now_->load, reg(B_), zero_number());
      compare(A_, B_, reg(ra), lt);
      three(now_->band, A_, A_, mask(one));
      compare(B_, ra, zero_number(), lt);
      three(now_->band, B_, B_, mask(one));
      three(now_->sub, A_, A_, reg(B_));
      break;
    case Op::ifelse:
      if (now_->vex) return emit_choice(i, ra, rb, rc);
      compare(A_, ra, zero_number(), neq);
      three(now_->band, B_, A_, reg(rb));
      three(now_->bandn, A_, A_, reg(rc));
      three(now_->bor, A_, A_, reg(B_));
      break;
    default:
      internal_error(__FILE__, __LINE__, "an operation without machine instructions");
  }
  consume(i);
  const int d = take(pinned);
  a_.emit(now_->copy, reg(d), reg(A_));
  return d;
}

/// Fused instructions overwrite an operand: c if it is no longer needed, else a or b, else a copy of c.
int Emitter::emit_fused(const Instruction& i) {
  const auto& kind = now_->fused[i.op == Op::add ? 0 : i.op == Op::sub ? 1 : 2];
  unsigned pinned = 0;
  Slot a = i.operand[0], b = i.operand[1];
  if (r_.of(a) < 0 && r_.of(b) >= 0) std::swap(a, b);
  const int rc = in_register(i.operand[2], pinned), ra = in_register(a, pinned), rb = r_.of(b);
  const Operand ob = operand(b);
  if (rb >= 0) pinned |= 1U << rb;
  consume(i);
  const auto is_free = [&](int r) { return r >= 0 && r_.in(r) == Registers::never; };
  if (is_free(rc)) {
    a_.emit(kind.sum, reg(rc), reg(ra), ob);
    return rc;
  }
  if (is_free(ra) || is_free(rb)) {
    const int d = is_free(ra) ? ra : rb;
    a_.emit(kind.product, reg(d), reg(rc), d == ra ? ob : Operand(reg(ra)));
    return d;
  }
  const int d = take(pinned);
  a_.emit(now_->copy, reg(d), reg(rc));
  a_.emit(kind.sum, reg(d), reg(ra), ob);
  return d;
}

/// Two numbers in the lower half of a scratch register.
void Emitter::insert_pair(int r, Slot low, Slot high) {
  const x86::Xmm to = x86::xmm(static_cast<std::uint32_t>(r));
  const auto in = [](int from) { return x86::xmm(static_cast<std::uint32_t>(from)); };
  const int a = r_.of(low), b = r_.of(high);
  if (a >= 0 && b >= 0) {
    a_.emit(x86::Inst::kIdVunpcklpd, to, in(a), in(b));
    return;
  }
  if (a < 0) a_.emit(x86::Inst::kIdVmovsd, to, at(r_.home(low), isa_));
  const x86::Xmm first = a < 0 ? to : in(a);
  if (b >= 0)
    a_.emit(x86::Inst::kIdVunpcklpd, to, first, in(b));
  else
    a_.emit(x86::Inst::kIdVmovhpd, to, first, at(r_.home(high), isa_));
}

/// Gathers four numbers: by a broadcast, by a load if they are adjacent, else one at a time.
int Emitter::emit_gather(const Instruction& i) {
  const Slot* e = p_.extra.data() + i.first_extra;
  const auto all = [e](auto holds) {
    for (Slot k = 1; k < Instruction::width; ++k)
      if (!holds(e[k], k)) return false;
    return true;
  };
  if (all([e](Slot v, Slot) { return v == e[0]; })) {
    const int from = r_.of(e[0]);
    const Operand source = from >= 0 ? Operand(reg(from, isa_)) : Operand(at(r_.home(e[0]), isa_));
    consume(i);
    const int d = take(from >= 0 ? 1U << from : 0U);
    a_.emit(x86::Inst::kIdVbroadcastsd, reg(d), source);
    return d;
  }
  const Home first = r_.home(e[0]);
  if (first && all([&](Slot v, Slot k) {
        const Home home = r_.home(v);
        return home.array == first.array && home.index == first.index + k;
      })) {
    consume(i);
    const int d = take(0);
    a_.emit(now_->load, reg(d), at(first));
    return d;
  }
  insert_pair(A_, e[0], e[1]);
  insert_pair(B_, e[2], e[3]);
  consume(i);
  const int d = take(0);
  a_.emit(x86::Inst::kIdVinsertf128, reg(d), reg(A_), reg(B_, isa_), Imm(1));
  return d;
}

int Emitter::emit_operation(const Instruction& i) {
  return is_arithmetic(i.op) ? emit_arithmetic(i) : emit_logic(i);
}

}  // namespace pendula::codegen

#endif
