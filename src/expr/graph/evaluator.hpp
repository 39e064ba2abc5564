// Numbers for expressions that are evaluated many times, where compiling a kernel would not pay: the order of
// the operations is found once.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula {

class Evaluator {
 public:
  /// Throws Error naming the first leaf that is not listed and has no value of its own (π has one), or an
  /// unspecified function. Cost: linear.
  Evaluator(std::span<const Expr> outputs, std::span<const Expr> leaves);

  std::size_t leaves() const { return leaves_; }
  std::size_t outputs() const { return outputs_.size(); }
  /// The values of the outputs, which may be NaN or inf, where the leaves have these values.
  std::vector<double> operator()(std::span<const double> leaves) const;
  /// Bounds of the rounding errors of the outputs, to first order, where the leaves are numbers rounded to
  /// doubles: running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §3.3).
  /// Those of solutions of linear systems are estimates. Cost: that of three evaluations.
  std::vector<double> rounding_errors(std::span<const double> leaves) const;

 private:
  using Place = std::uint32_t;
  struct Step {
    Op op;
    Place operand[3];
    Expr node;
  };
  /// By the head of a linear system.
  using Solutions = std::unordered_map<Expr, std::vector<double>>;
  double component(const Step& step, const std::vector<double>& values, Solutions& solutions) const;
  double error_of_component(const Step& step, const std::vector<double>& values,
                            const std::vector<double>& errors, Solutions& solution_errors) const;

  std::size_t leaves_;
  std::vector<double> constants_;  ///< stand behind the leaves, then the steps
  std::vector<Step> steps_;
  std::vector<Place> outputs_;
  std::unordered_map<Expr, Place> place_;
};

}  // namespace pendula
