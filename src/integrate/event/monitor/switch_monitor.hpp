// Narrow switches that a step has passed: tanh v, 1/(1 + eᵛ), log(1 + eᵛ), √(1 + v²) where v passes 0.
//
// For a step over which v changes by 16 and more they are jumps and kinks, like those of sign and max.
// The error estimate of such a step is unreliable: it may be far too small by chance, and may miss a
// term that is active in a part of the step only, such as the current of a smooth rectifier. As at
// other kinks, a step ends there.
#pragma once

#include <optional>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

class SwitchMonitor : public StepMonitor {
 public:
  /// The switches of a problem, in t, x, x′ and z.
  explicit SwitchMonitor(const Problem& problem);

  bool is_empty() const override { return count_ == 0; }
  /// v of all, and at how many passages of each a step was made to end.
  const std::vector<Expr>& switches() const { return switches_; }
  const std::vector<long>& located() const { return located_; }
  void restart(const ProblemPtr&, const Point&) override {}
  /// Until the first time inside the step at which a narrow switch is passed, on the cubic through its ends.
  /// Nothing where every second step would have to be repeated: there the error estimates must do. problem:
  /// with its present numbers. Cost: four evaluations of v, some 50 where one may be passed.
  std::optional<Rejection> after(const ProblemPtr& problem, const Point& from, const Point& to) override;

 private:
  using Values = std::vector<double>;
  static constexpr int pieces = 16;  ///< of a step, at whose ends v is looked at

  void evaluate(Problem& problem, const Point& point, Values& out) const;
  void sample(Problem& problem, const Point& from, const Point& to, double share, Values& out);
  bool is_due(Problem& problem, const Point& from, const Point& to);
  struct Passage {
    std::size_t which = 0;
    double share = 1;  ///< of the step; 1: none
  };
  Passage first_passage(Problem& problem, const Point& from, const Point& to);
  double root(Problem& problem, std::size_t which, int piece, const Point& from, const Point& to);

  std::vector<Expr> switches_;
  std::vector<long> located_;
  std::size_t count_ = 0;
  codegen::Kernel kernel_;       ///< v of all
  std::vector<Values> samples_;  ///< at the ends of the pieces
  Values inside_;
  Point there_;
  long steps_ = 0, repeated_ = 0;
};

}  // namespace pendula::integrate
