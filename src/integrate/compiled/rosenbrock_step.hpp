// The steps of a Rosenbrock method as machine code (explicit_step.hpp says why): Jacobian, factorisation,
// stages, error estimate and the coefficients of the dense output are one program.
#pragma once

#include <memory>
#include <vector>

#include "codegen/linear/straight_lu.hpp"
#include "codegen/machine/machine.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"
#include "method/rosenbrock.hpp"

namespace pendula::integrate {

class CompiledRosenbrockStep {
 public:
  /// in_mass: which entries of the Jacobian belong to the constant ∂F/∂x′; pivots: of M/(γh) + ∂F/∂y.
  struct Request {
    const Problem& problem;
    const Rosenbrock& method;
    const std::vector<char>& in_mass;
    const codegen::StraightLU& pivots;
    const Tolerances& tolerances;
  };
  /// The end of a step: y₁ = (x, z), x₁′, the scaled error, K₁ … Kᵣ of the dense output one after the other;
  /// sum and largest of the squares of the scaled error; the right side that the error solves. regular: the
  /// pivots suit this matrix; the other values mean nothing otherwise.
  struct End {
    const double *y, *xdot, *scaled, *dense, *undamped;
    double sum, largest;
    bool regular;
  };

  /// Nothing where there is no machine code or it would be long. Remembered for
  /// equal equations, method and pivots.
  static std::shared_ptr<CompiledRosenbrockStep> make(const Request& request);
  /// slope: ∂F/∂t by differences where the model has inputs (N numbers), else not
  /// read. Valid until the next run.
  End run(Problem& problem, const Point& from, double dt, const double* slope);

 private:
  std::vector<double> c_, in_, out_, work_;
  std::size_t n_ = 0, N_ = 0, stages_ = 0, slope_ = 0;  ///< sizes; where these begin, in in_
  std::shared_ptr<const codegen::Machine> machine_;
};

}  // namespace pendula::integrate
