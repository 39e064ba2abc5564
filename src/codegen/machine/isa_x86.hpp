// The x86-64 instructions of the emitter, in four kinds.
#pragma once

#include <asmjit/x86.h>

namespace pendula::codegen {

namespace x86 = asmjit::x86;

/// The instructions of one kind of code: an operation on one number, on four or on eight.
struct Isa {
  int lanes;
  bool vex;  ///< three operands
  /// A product and a sum in one, which replaces the sum's operand, or the product's first.
  struct Fused {
    x86::Inst::Id sum, product;
  };
  x86::Inst::Id load, store, copy, add, sub, mul, div, sqrt, min, max, cmp, band, bandn, bor, bxor;
  Fused fused[3];  ///< a·b + c, a·b - c, c - a·b
};
constexpr Isa sse2 = {1,
                      false,
                      x86::Inst::kIdMovsd,
                      x86::Inst::kIdMovsd,
                      x86::Inst::kIdMovapd,
                      x86::Inst::kIdAddsd,
                      x86::Inst::kIdSubsd,
                      x86::Inst::kIdMulsd,
                      x86::Inst::kIdDivsd,
                      x86::Inst::kIdSqrtsd,
                      x86::Inst::kIdMinsd,
                      x86::Inst::kIdMaxsd,
                      x86::Inst::kIdCmpsd,
                      x86::Inst::kIdAndpd,
                      x86::Inst::kIdAndnpd,
                      x86::Inst::kIdOrpd,
                      x86::Inst::kIdXorpd,
                      {}};
constexpr Isa avx = {1,
                     true,
                     x86::Inst::kIdVmovsd,
                     x86::Inst::kIdVmovsd,
                     x86::Inst::kIdVmovapd,
                     x86::Inst::kIdVaddsd,
                     x86::Inst::kIdVsubsd,
                     x86::Inst::kIdVmulsd,
                     x86::Inst::kIdVdivsd,
                     x86::Inst::kIdVsqrtsd,
                     x86::Inst::kIdVminsd,
                     x86::Inst::kIdVmaxsd,
                     x86::Inst::kIdVcmpsd,
                     x86::Inst::kIdVandpd,
                     x86::Inst::kIdVandnpd,
                     x86::Inst::kIdVorpd,
                     x86::Inst::kIdVxorpd,
                     {{x86::Inst::kIdVfmadd231sd, x86::Inst::kIdVfmadd132sd},
                      {x86::Inst::kIdVfmsub231sd, x86::Inst::kIdVfmsub132sd},
                      {x86::Inst::kIdVfnmadd231sd, x86::Inst::kIdVfnmadd132sd}}};
/// The same instructions work on registers of four and of eight numbers.
consteval Isa packed(int lanes) {
  return {lanes,
          true,
          x86::Inst::kIdVmovupd,
          x86::Inst::kIdVmovupd,
          x86::Inst::kIdVmovapd,
          x86::Inst::kIdVaddpd,
          x86::Inst::kIdVsubpd,
          x86::Inst::kIdVmulpd,
          x86::Inst::kIdVdivpd,
          x86::Inst::kIdVsqrtpd,
          x86::Inst::kIdVminpd,
          x86::Inst::kIdVmaxpd,
          x86::Inst::kIdVcmppd,
          x86::Inst::kIdVandpd,
          x86::Inst::kIdVandnpd,
          x86::Inst::kIdVorpd,
          x86::Inst::kIdVxorpd,
          {{x86::Inst::kIdVfmadd231pd, x86::Inst::kIdVfmadd132pd},
           {x86::Inst::kIdVfmsub231pd, x86::Inst::kIdVfmsub132pd},
           {x86::Inst::kIdVfnmadd231pd, x86::Inst::kIdVfnmadd132pd}}};
}
constexpr Isa avx4 = packed(4);
constexpr Isa avx512 = packed(8);  ///< conditions are masks there: see Emitter::compare

}  // namespace pendula::codegen
