// The steps of a fully implicit method as machine code (explicit_step.hpp says why): factorisations,
// starting values, one simplified Newton iteration, the end of a step with its error estimate.
//
// An iteration is the same work several times: the equations at every stage, and a linear system of one
// pattern for every eigenvalue of A⁻¹ = W. So stages, and systems, are the lanes of vector registers, and
// what W, T⁻¹ and T do between them are products of lanes (codegen/routines/lane_product.hpp):
//
//     R = F(tᵢ, y + Zᵢ, (W Z)ᵢ/h)   stages      (λM/h + J) Δ = (T⁻¹ ⊗ I) R   systems      Z ← Z - (T ⊗ I) Δ
//
// The systems are complex, with w₁ - i w₂ for the two rows of a pair of eigenvalues (irk_formula.hpp); the
// first one has the real eigenvalue, or the γ of the error estimate where there is none.
#pragma once

#include <complex>
#include <memory>
#include <vector>

#include "codegen/linear/straight_lu.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/routines/lane_product.hpp"
#include "integrate/problem/problem.hpp"
#include "method/irk_formula.hpp"

namespace pendula::integrate {

class CompiledNewtonStep {
 public:
  /// Everything the code depends on. `bare`: rows that the error estimate leaves out; in_mass: which entries
  /// of the Jacobian belong to ∂F/∂x′; pivots: of γ/h M + J, taken for all systems.
  struct Request {
    const Problem& problem;
    const IrkFormula& formula;
    const std::vector<char>& bare;
    const std::vector<char>& in_mass;
    const codegen::StraightLU& pivots;
  };
  /// The end of a step: error estimate ∈ ℝᴺ, Z (stage after stage), the new (x, z), x′; sum and largest of
  /// the squares of the error in units of the scales.
  struct End {
    const double *error, *Z, *y, *xdot;
    double sum, largest;
  };

  /// Code, if there is some, or if enough iterations would have used it (`iterations` more since the last
  /// call), or if `now`. Nothing otherwise, where it would be long, for more than seven stages, and where the
  /// processor has no lanes.
  static std::shared_ptr<CompiledNewtonStep> make(const Request& request, long iterations, bool now);

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
  /// Starting point of the last iteration, at a stage: h x′ and F, every `lanes`-th number.
  struct Stage {
    const double *slope, *residual;
  };
  Stage stage_of_last_iteration(int i) {
    const auto pass = static_cast<std::size_t>(i) / lanes, lane = static_cast<std::size_t>(i) % lanes;
    return {stage(pass, at_.stage_x()) + lane, residual_.data() + pass * lanes * at_.N + lane};
  }
  /// Valid until the next call.
  End end();
  /// The error estimate with another y: ‖…‖ as in End.
  End end_at(const double* y);

  static constexpr std::size_t lanes = 4;        ///< stages, or systems, at once
  static constexpr std::size_t most_stages = 7;  ///< three pairs and a real eigenvalue

 private:
  class Programs;
  /// Where numbers are, in units of a lane array: those of the stages, the systems, and the end.
  struct Layout {
    std::size_t n, N, s, p, u;  ///< sizes: states, unknowns, stages, parameters, inputs
    std::size_t entries, factors;
    explicit Layout(const Request& request);
    // in of the stages: y | p | 1/h | t, u | Z | h x′
    std::size_t stage_p() const { return N; }
    std::size_t stage_h() const { return stage_p() + p; }
    std::size_t stage_t() const { return stage_h() + 1; }
    std::size_t stage_Z() const { return stage_t() + 1 + u; }
    std::size_t stage_x() const { return stage_Z() + N; }
    std::size_t stage_size() const { return stage_x() + n; }
    // in of the systems: λ/h | entries of the Jacobian | factors | growth | right side
    std::size_t jacobian() const { return 2; }
    std::size_t factor() const { return jacobian() + entries; }
    std::size_t right() const { return factor() + 2 * factors + 1; }
    std::size_t system_size() const { return right() + 2 * N; }
    // in of the end, no lanes: 1/h | y | 1/scale | p | t, u | factors | Z
    std::size_t end_r() const { return 1 + N; }
    std::size_t end_p() const { return end_r() + N; }
    std::size_t end_t() const { return end_p() + p; }
    std::size_t end_factor() const { return end_t() + 1 + u; }
    std::size_t end_Z() const { return end_factor() + factors; }
    std::size_t end_size() const { return end_Z() + s * N; }
  };

  CompiledNewtonStep(const Layout& at, const Request& request);
  double* stage(std::size_t pass, std::size_t slot) { return stages_[pass].data() + slot * lanes; }
  double* system(std::size_t slot) { return system_.data() + slot * lanes; }
  codegen::LaneRows all_stages(std::size_t slot) {
    return {stage(0, slot), stages_.size() > 1 ? stage(1, slot) : nullptr, lanes};
  }
  /// The same number in all lanes, for all stages.
  void spread(std::size_t slot, double value);

  Layout at_;
  struct Columns {  ///< l: values of the basis polynomials of the last step
    codegen::LaneArray T, T_inverse, W, l;
  };
  Columns columns_;
  std::vector<std::complex<double>> lambda_;  ///< of the systems
  std::vector<char> in_mass_;
  std::vector<codegen::LaneArray> stages_;  ///< in of the stages, four at a time
  codegen::LaneArray residual_, system_, solution_, weigh_in_, weigh_out_, work_;
  std::vector<const double*> Z_at_, residual_at_, step_at_, past_at_;  ///< the rows that products take
  struct Product {
    codegen::LaneTerms terms;
    codegen::LaneRows to;
  };
  struct Products {  ///< W Z, T⁻¹ R, T Δ, and the last polynomial continued
    Product slopes, right, change, start;
  };
  Products products_{};
  std::vector<double> c_, times_, r_, end_in_, end_out_, shift_;
  struct Machines {
    std::shared_ptr<const codegen::Machine> residuals, factor, solve, weigh, end;
  };
  Machines machines_;
};

}  // namespace pendula::integrate
