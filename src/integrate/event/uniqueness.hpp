// Points from which more than one solution goes on.
//
// Where the slope of f is infinite, x′ = f(x) need not have one solution: from x = 0, x′ = √|x| may stay, or leave
// at any later time, and which of these a run follows is decided by rounding. Beside such a point the argument u of
// the root moves away from 0 at a rate u′ ~ |u|^q, 0 < q < 1: then ∫ du/u′, the time it takes, is finite (Osgood's
// criterion: Hartman, Ordinary Differential Equations, ch. III, cor. 6.2). A tank that runs empty, h′ = -√h, moves
// towards 0, and q = 0 where the solution passes; both are unique.
#pragma once

#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class UniquenessCheck {
 public:
  /// Of the roots √u and u^q, 0 < q < 1, in a problem's equations those whose u contains t, states and parameters only;
  /// |v|, max(v, 0) and 2 v count as v. Cost: one pass over the equations, remembered for the next run.
  explicit UniquenessCheck(const Problem& problem);
  bool empty() const { return roots_.empty(); }

  /// "x = 0 at t = 1 …" where more than one solution leaves this point, else "". Cost: a kernel of the arguments; six
  /// evaluations of x′ for each that is 0. derivative: of the equations in force.
  std::string at(RhsSolver& derivative, const Point& point, const Tolerances& tolerances);

 private:
  /// u, and what makes it 0.
  struct Root {
    Expr argument, node;
  };
  static std::vector<Root> roots_of(const Problem& problem);
  void evaluate(const Point& point);
  /// d/dt of argument k, if the solution went through this point.
  double rate(std::size_t k, RhsSolver& derivative, Point point);
  bool escapes(std::size_t k, RhsSolver& derivative, const Point& on, const Vec& direction, double size);

  ProblemPtr problem_;
  std::vector<Root> roots_;
  codegen::Kernel kernel_;  ///< of each root u, ∂u/∂t, ∂u/∂x
  std::vector<double> out_;
};

}  // namespace pendula::integrate
