// A model with numbers in it: compiled residual, exact sparse Jacobian, parameter values, input functions.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"
#include "base/remembered.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"
#include "integrate/problem/projection.hpp"

namespace pendula::integrate {

/// A point of a trajectory: x ∈ ℝⁿ, x′ ∈ ℝⁿ, z ∈ ℝᵐ.
struct Point {
  double t = 0;
  Vec x, xdot, z;
};

/// F(t, x, x′, z, u, p) = 0 and, for explicit ODEs, f(t, x, u, p). Evaluation is set_point() and then any of
/// the functions. Not for two threads at once. Copies share the equations and their functions.
class Problem {
 public:
  /// Of a tolerance: how far a new point of a step may be off the conditions of a projected form. Little
  /// beside the error of the step, and seldom exceeded, so that most points are not projected.
  static constexpr double projection_share = 0.1;
  using Input = std::function<double(double)>;

  /// parameters and inputs in the order of model.p and model.u. Throws Error on wrong sizes, parameters that
  /// are not finite, and equations with leaves that have no value.
  Problem(dae::FirstOrder model, Vec parameters, std::vector<Input> inputs = {});

  const dae::FirstOrder& model() const { return equations_->model; }
  /// One address for all copies: what follows from the equations can be remembered by it.
  std::shared_ptr<const dae::FirstOrder> shared_model() const { return {equations_, &equations_->model}; }
  /// F with all parameters, where some are numbers in model().F.
  const std::vector<Expr>& symbolic_residuals() const {
    return equations_->symbolic.empty() ? model().F : equations_->symbolic;
  }
  void keep_symbolic(std::vector<Expr> F) { equations_->symbolic = std::move(F); }
  int n() const { return static_cast<int>(model().x.size()); }
  int m() const { return static_cast<int>(model().z.size()); }
  bool is_ode() const { return model().is_ode(); }
  /// Other numbers; checked as by the constructor.
  void set_numbers(const Vec& parameters, std::vector<Input> inputs);
  /// How many of x and z are the user's: what stands behind them, ∂x/∂p and ∂z/∂p for each p of
  /// `sensitivities`, is not shown.
  int visible_n() const { return visible_n_.value_or(n()); }
  int visible_m() const { return visible_m_.value_or(m()); }
  const std::vector<Expr>& sensitivities() const { return sensitivities_; }
  void set_visible_size(int n, int m, std::vector<Expr> sensitivities) {
    visible_n_ = n;
    visible_m_ = m;
    sensitivities_ = std::move(sensitivities);
  }
  /// Gives the last parameters new values: the modes of piecewise equations (surfaces.hpp).
  void set_modes(const std::vector<double>& modes);
  /// Takes over the parameters, modes included, of a problem with the same ones.
  void take_parameters(const Problem& other);
  /// Another number after every change of the modes or parameters: what was factorised before is stale.
  unsigned version() const { return version_; }

  /// Conditions that every mesh point is moved onto; in states, inputs, parameters and t.
  void set_projections(const std::vector<dae::Projection>& stages);
  bool projects() const { return !projectors_.empty(); }
  const std::vector<dae::Projection>& projections() const { return projections_; }
  /// Moves x onto the conditions at time t, stage by stage. Throws Failure.
  void project(double t, Vec& x);
  /// The same, but only when a condition is violated by more than `share` of what a change of every state by
  /// its tolerance would do to it. Returns whether x moved.
  bool project_if_needed(double t, Vec& x, const Vec& rtol, const Vec& atol, double share);

  /// Chooses where to evaluate. Arrays of n, n and m numbers. Throws Failure naming an
  /// input that is not finite at t.
  void set_point(double t, const double* x, const double* xdot, const double* z);
  /// The same in two parts: the time (and inputs), then x, x′ and z written to unknowns(), 2n + m numbers.
  void set_time(double t);
  /// Inputs jump at this time, where a step ends: from here on they have their value just before it.
  void set_limit(double t) { limit_ = t; }
  double* unknowns() { return values_.data() + 1; }
  void residual(double* F);  ///< n + m values
  void rhs(double* f);       ///< n values; requires is_ode()
  /// Of rhs(), or of residual() where there is none.
  std::size_t operations() const { return is_ode() ? f_.operations() : F_.operations(); }

  /// ∂F/∂(x, x′, z) at the point: entries with columns 0 … n-1 | n … 2n-1 | 2n … 2n+m-1, sorted by rows.
  struct Entry {
    int row, column;
  };
  const std::vector<Entry>& pattern() const { return derivatives().pattern; }
  /// The entries as expressions, in the same order.
  const std::vector<Expr>& partials() const { return derivatives().partials; }
  /// A large model made explicit by linear solves: every x′ depends on every x, and the
  /// Jacobian must not be asked for.
  bool has_dense_jacobian() const { return equations_->dense_jacobian; }
  /// Makes machine code at once: thousands of evaluations are to come.
  void accelerate();
  const std::vector<double>& jacobian();

  /// The leaves [t, x, x′, z, u, p], the arguments of every kernel of this problem,
  /// and their values at the point.
  const std::vector<Expr>& arguments() const { return equations_->arguments; }
  const std::vector<double>& values() const { return values_; }

  /// As messages name them; "∂x/∂p" behind those that are shown.
  std::string x_name(int i) const;
  std::string xdot_name(int i) const;
  std::string z_name(int i) const;
  std::string equation_name(int row) const;  ///< the label, or "equation 3"

 private:
  struct Derivatives {
    std::vector<Entry> pattern;
    std::vector<Expr> partials;
  };
  struct Equations : Remembered {
    dae::FirstOrder model;
    std::vector<Expr> arguments;
    std::vector<Expr> symbolic;  ///< see symbolic_residuals(), or empty
    bool dense_jacobian = false;
    std::optional<Derivatives>
        derivatives;  ///< on first use: explicit methods need none, and they may be dense

   private:
    void forget() override { derivatives.reset(); }  // this may be known to objects that are older than they
  };
  const Derivatives& derivatives() const;
  std::shared_ptr<Equations> equations_;
  std::vector<Input> inputs_;
  std::vector<double> values_;
  std::vector<double> jacobian_values_;
  codegen::Kernel F_, f_, J_;
  bool accelerated_ = false, has_jacobian_ = false;
  std::vector<dae::Projection> projections_;
  std::vector<Projector> projectors_;
  std::optional<int> visible_n_, visible_m_;
  std::vector<Expr> sensitivities_;
  unsigned version_ = 0;
  double limit_ = std::numeric_limits<double>::infinity();
};

using ProblemPtr = std::shared_ptr<Problem>;

}  // namespace pendula::integrate
