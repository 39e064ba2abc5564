// The grouped tape: the portable back end and the reference of every other one.
//
// Workspace: inputs | constants | results. The results of one run are contiguous; their place is used again
// when the last of them has been read, so that large models stay in the cache. Within a run the members are
// arranged so that operands lie in arithmetic progression where the model repeats itself, and such stretches
// are loops with vector instructions.
#pragma once

#include "codegen/pieces.hpp"
#include "codegen/program.hpp"

namespace pendula::codegen {

class Tape {
 public:
  Tape() = default;
  explicit Tape(const Program& program);

  std::size_t inputs() const { return input_count_; }
  std::size_t outputs() const { return output_count_; }
  std::size_t operations() const;
  std::size_t workspace_size() const { return slots_; }
  /// The part of the operations that are loops over neighbouring operands.
  double regular_share() const;
  void run(const double* in, double* out, double* work) const;

 private:
  struct Run {
    Op op;
    Slot first_slot, count, first_operand;  ///< of Op::solve: first_operand is a linear step
    Slot first_piece, pieces;               ///< loops that come before; count and first_slot are without them
  };
  class Layout;
  /// A linear system on the tape: a factorisation, or a solution with one that was made before.
  struct LinearStep {
    bool factor;  ///< n² operands become LU and pivots, n² + n results; otherwise n become n
    int n;
    Slot first_operand;
    Slot factors;  ///< slot of LU and pivots
    bool transposed;
  };
  void run_linear(const LinearStep& step, Slot result, double* w) const;
  std::size_t input_count_ = 0, output_count_ = 0, slots_ = 0;
  std::vector<std::pair<std::size_t, std::size_t>> used_inputs_;  ///< from, to
  std::vector<double> constants_;
  std::vector<Run> runs_;
  std::vector<Piece> pieces_;
  std::vector<LinearStep> linear_;
  std::vector<Slot> operands_;  ///< arity × count slot numbers per run, operand by operand
  struct Copy {
    Slot slot, output, count;
  };
  std::vector<Copy> copies_;  ///< results to outputs, neighbours together
};

}  // namespace pendula::codegen
