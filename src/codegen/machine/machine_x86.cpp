// Machine code for x86-64: scalar SSE2 or AVX, four AVX2 lanes, eight AVX-512 lanes.
#include "codegen/machine/machine.hpp"

#ifdef PENDULA_MACHINE_CODE
#include "codegen/machine/emitter_x86.hpp"
#include "codegen/machine/functions.hpp"
#include "codegen/machine/wide_sines.hpp"
#include "codegen/program/contract.hpp"
#include "codegen/program/packs.hpp"
#include "codegen/routines/sines.hpp"

namespace pendula::codegen {
namespace {

using namespace asmjit;

JitRuntime& runtime() {
  static JitRuntime& runtime =
      *new JitRuntime;  // never destroyed, since caches return their code at the end of the process
  return runtime;
}

/// Tested once, with a function that only returns.
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
  const bool has_wide = lanes == 1 && isa->vex, sines = has_wide && wide_sincos_function();
  const Program source = has_wide ? packed(program) : program;
  const Program ready = sines ? with_wide_sines(source) : source;
  Emitter emitter(ready, *isa, code);
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
