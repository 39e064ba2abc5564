// The steps of a fully implicit method as machine code (explicit_code.hpp says why): factorisations,
// starting values, one simplified Newton iteration, the end of a step with its error estimate.
//
// The unknowns of the iteration are Z and, where x′ enters linearly with constant coefficients, F = M x′ +
// g(t, x, z), also the transformed w = (T⁻¹ ⊗ I) Z (irk_formula.hpp): the part of M x′ in the transformed
// residual is (Λ ⊗ M) w / h, and an iteration has two products with T instead of three.
#pragma once

#include <memory>
#include <vector>

#include "codegen/machine.hpp"
#include "codegen/straight_lu.hpp"
#include "integrate/irk_formula.hpp"
#include "integrate/problem.hpp"

namespace pendula::integrate {

class NewtonCode {
 public:
  /// What the code is made for. `bare`: rows that the error estimate leaves out; in_mass: which entries of
  /// the Jacobian belong to ∂F/∂x′; the plans of the factorisations: γ/h M + J, and one for every pair.
  struct Request {
    const Problem& problem;
    const IrkFormula& formula;
    const std::vector<char>& bare;
    const std::vector<char>& in_mass;
    const codegen::StraightLU* real;
    std::vector<const codegen::StraightLU*> complex;
  };
  /// The end of a step: error estimate ∈ ℝᴺ, sum and largest of its squares in units of the scales, Z, the
  /// new (x, z), x′.
  struct End {
    const double *error, *Z, *y, *xdot;
    double sum, largest;
  };

  /// Code, if there is some, or if enough iterations would have used it (`iterations` more since the last
  /// call), or if `now`. Nothing otherwise, and where it would be long.
  static std::shared_ptr<NewtonCode> make(const Request& request, long iterations, bool now);

  /// entries: those of the Jacobian. False where these pivots do not serve: nothing is factorised then.
  bool factorise(const std::vector<double>& entries, double dt);
  /// A step from t with these y (N) and scales (N) begins.
  void begin(Problem& problem, double t, double dt, const double* y, const double* scale);
  /// Starting values: the polynomial of the last step (size dt / ratio, from y with Z) continued.
  void predict(double ratio, const double* y, const double* Z);
  /// Starting values: these.
  void set(const double* Z);
  /// Z ← Z + ΔZ; sum and largest of the squares of ΔZ in units of the scales.
  void iterate(double& sum, double& largest);
  /// Valid until the next call.
  End end();
  /// The error estimate with another y: ‖…‖ as in End.
  End end_at(const double* y);

 private:
  struct Layout {
    std::size_t n, y, r, p, stages, factors, state, Z, end;
    Layout(const Request& request, bool constant_mass);
  };
  class Programs;
  NewtonCode(const Layout& at, const IrkFormula& formula) : at_(at), T_inverse_(formula.T_inverse) {}

  Layout at_;
  Mat T_inverse_;
  std::vector<double> c_, in_, out_, work_, matrix_, past_;
  std::shared_ptr<const codegen::Machine> factor_, predict_, iterate_, end_;
};

}  // namespace pendula::integrate
