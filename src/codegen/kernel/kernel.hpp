// Expressions become a numeric function: one evaluation of all outputs for one point.
//
// A Kernel is immutable and can be called from several threads when each brings its own workspace. The
// default back end is the grouped tape: instructions are scheduled in runs of one operation, so that the
// interpreter's dispatch is paid per run and not per operation (docs/decisions/010), every result is
// bit-reproducible and uses the scalar libm. A kernel that is run often gets machine code on the way, with
// the same results bit for bit. Systems of saddle_solution() are solved without pivoting, except at
// points where that is not stable.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {

/// exact: a / b is rounded once. shared: what divides several times, or is a constant, becomes a factor; on
/// the tape and in machine code alike.
enum class Divisions { exact, shared };

class Kernel {
 public:
  Kernel() = default;

  /// Compiles outputs as functions of the leaves `inputs`. Named constants (π) and numbers are built in;
  /// parameters are always inputs. Throws Error naming a leaf that is not among the inputs, or an unspecified
  /// function. Cost: linear in the number of nodes (10⁶ nodes: under a second); nothing if the same outputs
  /// and inputs were compiled before and are still remembered.
  Kernel(std::span<const Expr> outputs, std::span<const Expr> inputs, Divisions divisions = Divisions::exact);

  std::size_t inputs() const { return input_count_; }
  std::size_t outputs() const { return output_count_; }
  std::size_t operations() const;  ///< instructions on the tape
  std::size_t workspace_size() const { return slots_; }

  /// in: inputs() values, out: outputs() values, work: workspace_size() values; they must not overlap. No
  /// allocation, but for the one evaluation in which machine code is made.
  void run(const double* in, double* out, double* work) const;
  /// The same with a private workspace; not for two threads at once.
  void operator()(const double* in, double* out) const { run(in, out, work()); }
  std::vector<double> operator()(std::span<const double> in) const;

  /// Makes machine code at once, for a kernel that is going
  /// to be run thousands of times. True if there is some.
  bool accelerate() const;
  bool is_machine_code() const;  ///< whether run() uses it already

 private:
  struct Code;
  double* work() const;
  std::shared_ptr<Code> code_;  ///< shared by copies and by kernels of the same expressions
  std::size_t input_count_ = 0, output_count_ = 0, slots_ = 0;
  mutable std::vector<double> work_;
};

}  // namespace pendula::codegen
