// Whole steps as straight-line machine code.
//
// On a small model most of the time of a step goes into what surrounds the equations: calls, loops over a
// handful of numbers, stage sums, triangular solves. Here the equations of all stages, the sums of the
// tableau and the solutions with the factors at hand become one program, whose values live in registers. Its
// results are those of the loops it replaces, to rounding. There is none for long programs, where the
// equations themselves dominate.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "codegen/straight_lu.hpp"
#include "integrate/irk_formula.hpp"
#include "integrate/problem.hpp"

namespace pendula::integrate {

/// All stages of an explicit method on an explicit ODE: x₁ = x + h Σ bᵢ Kᵢ and the error estimates.
class ExplicitCode {
 public:
  /// Nothing where there is no machine code or it would be long. Remembered for equal equations and tableau.
  static std::shared_ptr<ExplicitCode> make(const Problem& problem, const Tableau& rk);

  /// out: K₂ … K_s, x₁, h Σ (bᵢ - b̂ᵢ) Kᵢ, and the same with a second embedded method (or zeros): (s + 2) n
  /// numbers. Inputs of the model are evaluated at the stages through `problem`.
  void run(Problem& problem, const Point& from, double dt, double* out);

 private:
  std::vector<double> c_, in_, work_;
  std::shared_ptr<const codegen::Machine> machine_;
};

/// One simplified Newton iteration of a fully implicit method: irk_stepper.hpp says for which equations.
class NewtonCode {
 public:
  using Complex = std::vector<const codegen::StraightLU*>;

  /// Code for these factorisations, if there is some, or if enough iterations would have used it
  /// (`iterations` more since the last call), or if `now`. Nothing otherwise, and where it would be long.
  static std::shared_ptr<NewtonCode> make(const Problem& problem, const IrkFormula& formula,
                                          const codegen::StraightLU* real, const Complex& complex,
                                          long iterations, bool now);
  /// Was it made for these pivots?
  bool suits(const codegen::StraightLU* real, const Complex& complex) const;
  void set_factors(const codegen::StraightLU* real, const Complex& complex);
  /// A step from t with these y (N) and scales (N) begins.
  void begin(Problem& problem, double t, double dt, const double* y, const double* scale);
  /// Z ← Z + ΔZ; sum and largest of the squares of ΔZ in units of the scales. Z: s·N numbers.
  void iterate(std::vector<double>& Z, double& sum, double& largest);

 private:
  struct Layout {
    std::size_t y, r, p, stages, real, complex, Z, end;
    Layout(const Problem& problem, int s, const codegen::StraightLU* real, const Complex& complex);
  };
  NewtonCode(const Layout& at) : at_(at) {}
  static codegen::Program program(const Problem& problem, const IrkFormula& formula, const Layout& at,
                                  const codegen::StraightLU* real, const Complex& complex);
  Layout at_;
  std::vector<double> c_, in_, out_, work_;
  std::vector<std::shared_ptr<const void>> pivots_;
  std::shared_ptr<const codegen::Machine> machine_;
};

}  // namespace pendula::integrate
