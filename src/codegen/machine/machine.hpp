// Machine code of a program: x86-64 through asmjit's Assembler and a register allocation of our own.
// Why not LLVM or asmjit's Compiler: docs/decisions/010-tape-and-machine-code.md.
//
// One pass over the instructions in order. A value lives in a register, at home in
// memory, or both; inputs, constants and outputs have their home from the start, others
// get a slot of the workspace when they must leave their register. The register given up
// is the one whose value is needed last (Belady, IBM Systems Journal 5, 1966). Functions
// are those that the tape calls (libm's; sines and cosines four at a time,
// functions.hpp), so both agree bit for bit.
#pragma once

#include <cstddef>
#include <memory>

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// exact: every operation rounds, as on the tape. fused: products and sums are one operation where the
/// processor has it, twice as fast in long sums; the last digits then depend on the processor.
enum class Rounding { exact, fused };

class Machine {
 public:
  /// Code for `lanes` points at once: 1, 4 with AVX2 or 8 with AVX-512. Number k of a point lies at
  /// [lanes·k + lane]; sin, exp … of several lanes are SLEEF's reproducible ones, within 1 ulp of libm's. The
  /// results of a lane do not depend on its neighbours nor on the number of lanes beyond one.
  ///
  /// returns  nothing where available(lanes) is false, or the system gives no more executable memory: every
  ///          caller has another way
  /// cost     linear, about 0.15 µs per instruction        threads  run() may be called by several at once
  static std::unique_ptr<const Machine> compile(const Program& program, int lanes = 1,
                                                Rounding rounding = Rounding::exact);
  /// Is there a code generator for so many lanes, and does the system allow executable memory (not with
  /// PR_SET_MDWE, systemd's MemoryDenyWriteExecute or a strict SELinux policy)?
  static bool available(int lanes = 1);
  /// The most lanes there is one for: 8, 4 or 1.
  static int widest();
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  /// in, out and work must not overlap; work has workspace_size() numbers.
  void run(const double* in, double* out, double* work) const { function_(in, out, work); }
  std::size_t workspace_size() const { return workspace_; }

 private:
  using Function = void (*)(const double*, double*, double*);
  Machine(Function function, std::size_t workspace) : function_(function), workspace_(workspace) {}
  Function function_;
  std::size_t workspace_;
};

}  // namespace pendula::codegen
