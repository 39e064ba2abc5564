// Points from which more than one solution continues.
//
// Where the slope of f is infinite, x′ = f(x) need not have one solution: from x = 0, x′ = √|x| may stay, or
// leave at any later time, and which of these a run follows is decided by rounding. Beside such a point the
// argument u of the root moves away from 0 at a rate u′ ~ |u|^q, 0 < q < 1: then ∫ du/u′, the time it takes,
// is finite (Osgood's criterion: Hartman, Ordinary Differential Equations, ch. III, cor. 6.2). A tank that
// runs empty, h′ = -√h, moves towards 0, and q = 0 where the solution passes; both are unique.
//
// At second order, x″ = √|x|, u is left from rest: u = u′ = 0, and u″ ~ |u|^q beside it. From u = 0 then
// u′ = √(2 ∫ u″ du) ~ u^((1+q)/2), which for q < 1 is the case above. So for u⁽ᵏ⁾ ~
// |u|^q, with u … u⁽ᵏ⁻¹⁾ all 0.
#pragma once

#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class UniquenessCheck {
 public:
  /// Collects the roots √u and u^q, 0 < q < 1, of a problem's equations whose u contains t, states and
  /// parameters only (|v|, max(v, 0) and 2 v count as v), and of u′, u″ … those that contain nothing else
  /// either, nor a root. Cost: one pass over the equations, cached for the next run.
  explicit UniquenessCheck(const Problem& problem);
  bool empty() const { return roots_.empty(); }

  /// "x = 0 at t = 1 …" where more than one solution leaves this point, else "". Cost: a kernel of the
  /// arguments; six evaluations of x′ for each that is 0. derivative: of the equations in force. is_root: a
  /// step ended here because a border was found here, and u is 0 within its error.
  std::string at(RhsSolver& derivative, const Point& point, const Tolerances& tolerances, bool is_root);

 private:
  /// u, u′, u″ … as far as they are functions of t and the states without roots, and the root of u.
  struct Root {
    std::vector<Expr> chain;
    Expr node;
  };
  static std::vector<Root> roots_of(const Problem& problem);
  void evaluate(const Point& point);
  /// Of the last evaluation: u⁽ⁱ⁾ of root k, ∂u⁽ⁱ⁾/∂t, ∂u⁽ⁱ⁾/∂x.
  const double* row(std::size_t k, std::size_t i) const {
    return out_.data() + (first_[k] + i) * static_cast<std::size_t>(states_ + 2);
  }
  /// d/dt of the last of chain k, if the solution went through this point.
  double rate(std::size_t k, RhsSolver& derivative, Point point);
  bool is_zero(std::size_t k, const Vec& unit, double located) const;
  bool leaves_from(std::size_t k, RhsSolver& derivative, const Point& point, const Vec& unit);
  bool escapes(std::size_t k, RhsSolver& derivative, const Point& on, const Vec& direction, double size);

  ProblemPtr problem_;
  std::vector<Root> roots_;
  std::vector<std::size_t> first_;  ///< place of each chain among all of them
  Eigen::Index states_ = 0;
  codegen::Kernel kernel_;           ///< of all chains u and the slopes that are not 0
  std::vector<std::size_t> places_;  ///< of its values in out_
  std::vector<double> found_, out_;  ///< its values; of all chains u, ∂u/∂t, ∂u/∂x
};

}  // namespace pendula::integrate
