// The grouped tape: the portable back end and the reference of every other one.
//
// Numbers are inputs | constants | results; loops read inputs where they are, the workspace has a copy of
// those that other operations read. The results of one run are contiguous; their place is used again when the
// last of them has been read, so that large models stay in the cache. Within a run the members are arranged
// so that operands lie in arithmetic progression where the model repeats itself, and such stretches are loops
// with vector instructions.
#pragma once

#include "codegen/program/program.hpp"
#include "codegen/tape/fused_loops.hpp"

namespace pendula::codegen {

class Tape {
 public:
  Tape() = default;
  explicit Tape(const Program& program);

  std::size_t inputs() const { return input_count_; }
  std::size_t outputs() const { return output_count_; }
  std::size_t operations() const;
  std::size_t workspace_size() const { return slots_ + line; }
  /// The part of the operations that are loops over neighbouring operands.
  double regular_share() const;
  void run(const double* in, double* out, double* work) const;

 private:
  struct Run {
    Op op;
    Slot first_slot, count, first_operand;  ///< of Op::solve: first_operand is a linear step
    Slot first_loop, loops;                 ///< those that come before
  };
  class Emitter;
  static constexpr Slot line = 8;  ///< numbers; the workspace begins with a line of the cache
  /// Slots between the inputs and the others: no loop begins in the inputs and ends behind them.
  static constexpr Slot gap = 16;
  /// A linear system on the tape: a factorisation, or a solution with one that was made before.
  struct LinearStep {
    bool factor;              ///< a matrix becomes its factors; otherwise n numbers become n
    int n, band;              ///< band: as in Instruction
    Slot first_copy, copies;  ///< operands, from slots to places behind the result's slot
    Slot factors;             ///< slot of the factors
    bool transposed;
  };
  void run_linear(const LinearStep& step, Slot result, const double* in, double* w) const;
  std::size_t input_count_ = 0, output_count_ = 0, slots_ = 0, regular_ = 0;
  std::vector<std::pair<std::size_t, std::size_t>> used_inputs_;  ///< from, to: copied into the workspace
  std::vector<double> constants_;
  std::vector<Run> runs_;
  std::vector<FusedLoop> loops_;
  std::vector<LinearStep> linear_;
  std::vector<Copy> linear_copies_;
  std::vector<Slot> operands_;  ///< arity × count slot numbers per run, operand by operand
  std::vector<Copy> copies_;    ///< results to outputs
};

}  // namespace pendula::codegen
