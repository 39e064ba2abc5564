// Machine code for x86-64: scalar SSE2 or AVX, four AVX2
// lanes, eight AVX-512 lanes. The only file that knows asmjit.
#include "codegen/machine/machine.hpp"

#ifdef PENDULA_MACHINE_CODE
#include <algorithm>
#include <cstring>
#include <unordered_map>

#include <asmjit/x86.h>

#include "base/error.hpp"
#include "codegen/machine/functions.hpp"
#include "codegen/machine/isa_x86.hpp"
#include "codegen/machine/registers.hpp"
#include "codegen/program/contract.hpp"
#include "expr/graph/operation.hpp"

namespace pendula::codegen {
namespace {

using namespace asmjit;

JitRuntime& runtime() {
  static JitRuntime& runtime =
      *new JitRuntime;  // for ever: caches that end with the process give their code back
  return runtime;
}

/// Tried once, with a function that only returns.
bool may_execute() {
  static const bool allowed = [] {
    CodeHolder code;
    if (code.init(runtime().environment()) != kErrorOk) return false;
    x86::Assembler assembler(&code);
    assembler.ret();
    void (*function)() = nullptr;
    if (runtime().add(&function, &code) != kErrorOk) return false;
    runtime().release(function);
    return true;
  }();
  return allowed;
}

bool has_avx2() {
  const auto& f = CpuInfo::host().features().x86();
  return f.hasAVX() && f.hasAVX2();
}

bool has_avx512() {
  const auto& f = CpuInfo::host().features().x86();
  return has_avx2() && f.hasAVX512_F() && f.hasAVX512_DQ();
}

bool has_fma() { return CpuInfo::host().features().x86().hasFMA(); }

const Isa* isa_for(int lanes) {
  if (lanes > 1 && !lane_function(Op::sin, lanes)) return nullptr;
  if (lanes == 8) return has_avx512() ? &avx512 : nullptr;
  if (lanes == 4) return has_avx2() ? &avx4 : nullptr;
  if (lanes != 1) return nullptr;
  return has_avx2() ? &avx : &sse2;
}

constexpr bool is_direct(CodeKind kind) { return kind == CodeKind::direct; }
constexpr int direct_operations = 0
#define OP(name, arity, style, parity, exact, code, ...) +is_direct(CodeKind::code)
#include "expr/ops.def"
#undef OP
    ;
static_assert(
    direct_operations == 15,
    "a row of ops.def is marked `direct`: emit_arithmetic or emit_logic must know its instructions");

/// Operations that are one machine instruction; the other direct ones are made of comparisons and masks.
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

/// Emits one program. The last two registers, A_ and B_, are scratch, the others hold values.
class Emitter {
 public:
  Emitter(const Program& program, const Isa& isa, CodeHolder& code)
      : p_(program),
        isa_(isa),
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

  void emit_all() {
    a_.push(x86::rbx);
    a_.push(x86::r12);
    a_.push(x86::r13);
    a_.mov(x86::rbx, x86::rdi);
    a_.mov(x86::r12, x86::rsi);
    a_.mov(x86::r13, x86::rdx);
    copy_leaf_results();
    for (Slot i : order_) emit(p_.first_instruction() + i, p_.instructions[i]);
    if (isa_.lanes > 1) a_.vzeroupper();
    a_.pop(x86::r13);
    a_.pop(x86::r12);
    a_.pop(x86::rbx);
    a_.ret();
    embed_constants();
  }

  std::size_t work_numbers() const { return r_.work_size() * static_cast<std::size_t>(isa_.lanes); }

 private:
  // ── memory and registers ──
  x86::Vec reg(int r) const {
    const auto id = static_cast<std::uint32_t>(r);
    return isa_.lanes == 8   ? x86::Vec(x86::zmm(id))
           : isa_.lanes == 4 ? x86::Vec(x86::ymm(id))
                             : x86::Vec(x86::xmm(id));
  }
  x86::Mem at(Home home) const {
    const auto offset = static_cast<std::int32_t>(home.index) * 8 * isa_.lanes;
    const auto size = static_cast<std::uint32_t>(8 * isa_.lanes);
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
                    static_cast<std::uint32_t>(std::max(2, isa_.lanes) * 8));
  }

  void load(int r, Slot value) {
    if (const int from = r_.of(value); from >= 0) {
      if (from != r) a_.emit(isa_.copy, reg(r), reg(from));
    } else {
      a_.emit(isa_.load, reg(r), at(r_.home(value)));
    }
  }
  void keep(int r) {  ///< gives the value of a register a home
    Home& home = r_.home(r_.in(r));
    if (home) return;
    home = {Home::Array::work, r_.new_slot()};
    a_.emit(isa_.store, at(home), reg(r));
  }
  int take(unsigned pinned) {  ///< a register for a new value
    if (const int r = r_.vacant(); r >= 0) return r;
    const int r = r_.furthest(pinned);
    keep(r);
    r_.empty(r);
    return r;
  }
  int in_register(Slot value, unsigned& pinned) {
    int r = r_.of(value);
    if (r < 0) {
      r = take(pinned);
      load(r, value);
      r_.assign(r, value);
    }
    pinned |= 1U << r;
    return r;
  }
  Operand operand(Slot value) const {
    const int r = r_.of(value);
    return r >= 0 ? Operand(reg(r)) : Operand(at(const_cast<Registers&>(r_).home(value)));
  }

  // ── operations ──
  /// d = a op b; d may be the register of a. In SSE code d must not be that of b.
  void three(x86::Inst::Id op, int d, int a, const Operand& b) {
    if (isa_.vex) {
      a_.emit(op, reg(d), reg(a), b);
      return;
    }
    if (d != a) a_.emit(isa_.copy, reg(d), reg(a));
    a_.emit(op, reg(d), b);
  }
  void compare(int d, int a, const Operand& b, unsigned predicate) {
    if (isa_.lanes == 8) {
      a_.emit(isa_.cmp, x86::k1, reg(a), b, Imm(predicate));
      a_.vpmovm2q(reg(d), x86::k1);
      return;
    }
    if (isa_.vex) {
      a_.emit(isa_.cmp, reg(d), reg(a), b, Imm(predicate));
      return;
    }
    if (d != a) a_.emit(isa_.copy, reg(d), reg(a));
    a_.emit(isa_.cmp, reg(d), b, Imm(predicate));
  }
  Operand zero_number() const {
    return x86::ptr(constants_, 8 * mask_numbers * zero, static_cast<std::uint32_t>(8 * isa_.lanes));
  }

  void emit(Slot value, const Instruction& i);
  int emit_arithmetic(const Instruction& i);
  int emit_logic(const Instruction& i);
  int emit_choice(const Instruction& i, int ra, int rb, int rc);
  int emit_fused(const Instruction& i);
  void emit_call(Slot value, const Instruction& i);
  void emit_pair(Slot value, Slot partner, const Instruction& i);
  void emit_linear(Slot value, const Instruction& i);
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
  const int values_, A_, B_;
  x86::Assembler a_;
  std::vector<Slot> order_;
  Registers r_;
  Label constants_;
  std::unordered_map<Slot, Slot> partner_;  ///< of sin(a) and cos(a): the one that comes later
  std::vector<Slot> outputs_, outputs_of_;  ///< positions of outputs, value by value
};

void Emitter::result_positions() {
  outputs_of_.assign(p_.first_instruction() + p_.instructions.size() + 1, 0);
  for (Slot value : p_.results) ++outputs_of_[value + 1];
  for (std::size_t i = 1; i < outputs_of_.size(); ++i) outputs_of_[i] += outputs_of_[i - 1];
  outputs_.resize(p_.results.size());
  std::vector<Slot> next(outputs_of_.begin(), outputs_of_.end() - 1);
  for (Slot k = 0; k < p_.results.size(); ++k) outputs_[next[p_.results[k]]++] = k;
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

/// The result is in register r: it goes to its outputs, and stays if it is used again.
void Emitter::finish(Slot value, int r) {
  for (Slot k = outputs_of_[value]; k < outputs_of_[value + 1]; ++k) {
    const Home out{Home::Array::output, outputs_[k]};
    a_.emit(isa_.store, at(out), reg(r));
    r_.home(value) = out;
  }
  if (r_.alive(value)) r_.assign(r, value);
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
    if (isa_.vex && isa_.lanes == 1) {
      // vsqrtsd takes the upper half from its second operand
      if (from.isReg())
        a_.emit(isa_.sqrt, reg(d), from, from);
      else {
        a_.emit(isa_.load, reg(A_), from);
        a_.emit(isa_.sqrt, reg(d), reg(A_), reg(A_));
      }
    } else {
      a_.emit(isa_.sqrt, reg(d), from);
    }
    return d;
  }
  const int ra = in_register(a, pinned);
  if (i.op == Op::neg || i.op == Op::abs) {
    consume(i);
    const int d = take(pinned);
    three(i.op == Op::neg ? isa_.bxor : isa_.band, d, ra, mask(i.op == Op::neg ? sign_bit : all_but_sign));
    return d;
  }
  const Operand ob = operand(b);
  if (ob.isReg()) pinned |= 1U << ob.as<x86::Vec>().id();
  const x86::Inst::Id op = binary_instruction(isa_, i.op);
  consume(i);
  // With two operands, the first register becomes the result if its value is not needed any more.
  int d = !isa_.vex && r_.in(ra) == Registers::never ? ra : take(pinned);
  if (!isa_.vex && d != ra && ob.isReg() && static_cast<int>(ob.as<x86::Vec>().id()) == d) {
    a_.emit(isa_.copy, reg(B_), reg(d));  // the result would overwrite the second operand
    three(op, d, ra, reg(B_));
    return d;
  }
  three(op, d, ra, ob);
  return d;
}

/// ifelse where there is an instruction for it.
int Emitter::emit_choice(const Instruction& i, int ra, int rb, int rc) {
  constexpr unsigned neq = 4;
  if (isa_.lanes == 8) {
    a_.emit(isa_.cmp, x86::k1, reg(ra), zero_number(), Imm(neq));
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
      three(isa_.band, A_, A_, mask(one));
      break;
    case Op::both:
    case Op::either:
      compare(A_, ra, zero_number(), neq);
      compare(B_, rb, zero_number(), neq);
      three(i.op == Op::both ? isa_.band : isa_.bor, A_, A_, reg(B_));
      three(isa_.band, A_, A_, mask(one));
      break;
    case Op::sign:
      a_.emit(isa_.load, reg(B_), zero_number());
      compare(A_, B_, reg(ra), lt);
      three(isa_.band, A_, A_, mask(one));
      compare(B_, ra, zero_number(), lt);
      three(isa_.band, B_, B_, mask(one));
      three(isa_.sub, A_, A_, reg(B_));
      break;
    case Op::ifelse:
      if (isa_.vex) return emit_choice(i, ra, rb, rc);
      compare(A_, ra, zero_number(), neq);
      three(isa_.band, B_, A_, reg(rb));
      three(isa_.bandn, A_, A_, reg(rc));
      three(isa_.bor, A_, A_, reg(B_));
      break;
    default:
      internal_error(__FILE__, __LINE__, "an operation without machine instructions");
  }
  consume(i);
  const int d = take(pinned);
  a_.emit(isa_.copy, reg(d), reg(A_));
  return d;
}

/// The instructions overwrite an operand: c if it is not needed any more, else a or b, else a copy of c.
int Emitter::emit_fused(const Instruction& i) {
  const auto& kind = isa_.fused[i.op == Op::add ? 0 : i.op == Op::sub ? 1 : 2];
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
  a_.emit(isa_.copy, reg(d), reg(rc));
  a_.emit(kind.sum, reg(d), reg(ra), ob);
  return d;
}

void Emitter::leave_registers() {
  for (int r = 0; r < values_; ++r) {
    if (r_.in(r) == Registers::never) continue;
    keep(r);
    r_.empty(r);
  }
}

void Emitter::call(const void* function) {
  a_.mov(x86::rax, Imm(reinterpret_cast<std::uintptr_t>(function)));
  a_.call(x86::rax);
}

void Emitter::emit_call(Slot value, const Instruction& i) {
  // Operands go through the scratch registers: the arguments may sit in each other's places.
  load(B_, i.operand[0]);
  if (i.operands() > 1) load(A_, i.operand[1]);
  consume(i);
  leave_registers();
  a_.emit(isa_.copy, reg(0), reg(B_));
  if (i.operands() > 1) a_.emit(isa_.copy, reg(1), reg(A_));
  call(isa_.lanes > 1 ? lane_function(i.op, isa_.lanes) : scalar_function(i.op));
  finish(value, 0);
}

/// Sine and cosine of one argument come from one call.
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
  if (partner == value) return consume(i);  // computed with the first
  load(B_, i.operand[0]);
  consume(i);
  leave_registers();
  a_.emit(isa_.copy, reg(0), reg(B_));
  call(sincos_function());
  finish(i.op == Op::sin ? value : partner, 0);
  finish(i.op == Op::sin ? partner : value, 1);
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
  if (isa_.lanes > 1) a_.vzeroupper();
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
    r_.home(value) = home;  // the components are found from here
  }
}

void Emitter::emit(Slot value, const Instruction& i) {
  r_.next_instruction();
  if (i.part == Part::factor || i.part == Part::solve) {
    emit_linear(value, i);
  } else if (i.part == Part::component) {
    Home home = r_.home(i.operand[0]);
    home.index += i.operand[1];
    r_.home(value) = home;
    consume(i);
    if (outputs_of_[value] < outputs_of_[value + 1]) {
      a_.emit(isa_.load, reg(B_), at(home));
      for (Slot k = outputs_of_[value]; k < outputs_of_[value + 1]; ++k)
        a_.emit(isa_.store, at({Home::Array::output, outputs_[k]}), reg(B_));
    }
  } else if (i.part == Part::fused) {
    finish(value, emit_fused(i));
  } else if (const auto pair = partner_.find(value); pair != partner_.end()) {
    emit_pair(value, pair->second, i);
  } else if (is_call(i)) {
    emit_call(value, i);
  } else {
    finish(value, is_arithmetic(i.op) ? emit_arithmetic(i) : emit_logic(i));
  }
}

}  // namespace

bool Machine::available(int lanes) { return isa_for(lanes) != nullptr && may_execute(); }
int Machine::widest() { return available(8) ? 8 : available(4) ? 4 : 1; }

std::unique_ptr<const Machine> Machine::compile(const Program& program, int lanes, Rounding rounding) {
  if (!available(lanes)) return nullptr;
  const Isa* isa = isa_for(lanes);
  if (rounding == Rounding::fused && isa->vex && has_fma())
    return compile(contracted(program), lanes, Rounding::exact);
  CodeHolder code;
  if (code.init(runtime().environment()) != kErrorOk) return nullptr;
  Emitter emitter(program, *isa, code);
  emitter.emit_all();
  Function function = nullptr;
  if (runtime().add(&function, &code) != kErrorOk) return nullptr;
  return std::unique_ptr<const Machine>(new Machine(function, emitter.work_numbers()));
}

Machine::~Machine() { runtime().release(function_); }

}  // namespace pendula::codegen

#else

namespace pendula::codegen {
bool Machine::available(int) { return false; }
int Machine::widest() { return 1; }
std::unique_ptr<const Machine> Machine::compile(const Program&, int, Rounding) { return nullptr; }
Machine::~Machine() = default;
}  // namespace pendula::codegen

#endif
