#include "integrate/solution/adjoint.hpp"

#include <map>

#include "base/decompositions.hpp"
#include "base/interrupt.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/step/runge_kutta.hpp"

namespace pendula::integrate {
namespace {

using Eigen::Index;

Vec solved(const Mat& A, const Vec& b, double t) {
  const Vec result = Eigen::PartialPivLU<Mat>(A).solve(b);
  if (!result.allFinite())
    throw Failure(
        text("the adjoint equations are singular at t = ", t, ": x′ and z are not determined there"));
  return result;
}

class Sweep {
 public:
  Sweep(const ProblemPtr& problem, const std::vector<Expr>& parameters)
      : problem_(problem), n_(problem->n()), N_(problem->n() + problem->m()) {
    std::vector<Expr> partials;
    for (const pendula::Entry& e : sparse_jacobian(problem->symbolic_residuals(), parameters)) {
      parameter_entries_.push_back({e.row, e.column});
      partials.push_back(e.value);
    }
    by_parameters_ = codegen::Kernel(partials, problem->arguments());
    gradient_ = Vec::Zero(static_cast<Index>(parameters.size()));
  }

  /// λ at the end of the run, where x′ and z satisfy the equations.
  Vec finish(const Point& end, Expr cost, const std::vector<Expr>& parameters) {
    std::vector<Expr> unknowns(problem_->arguments().begin() + 1,
                               problem_->arguments().begin() + 1 + n_ + N_);
    unknowns.insert(unknowns.end(), parameters.begin(), parameters.end());
    const codegen::Kernel slopes(gradient(cost, unknowns), problem_->arguments());
    linearise(end.t, end.x, end.xdot, end.z);
    const std::vector<double> g = slopes(problem_->values());
    const Eigen::Map<const Vec> all(g.data(), static_cast<Index>(g.size()));
    gradient_ += all.tail(gradient_.size());
    Vec lambda = all.head(n_);
    const Vec inner = all.segment(n_, N_);
    if (inner.isZero(0)) return lambda;
    const Vec nu = solved(inner_.transpose(), inner, end.t);
    collect(nu);
    return lambda - Fx_.transpose() * nu;
  }

  Vec back(const DiscreteStep& step, const Vec& lambda) {
    if (!step.modes.empty()) problem_->set_modes(step.modes);
    RungeKutta& engine = engine_for(step.tableau);
    const double dt = step.to - step.from.t;
    problem_->set_limit(step.to);  // inputs may jump there
    Point unused;
    engine.step(step.from, dt, unused, false);
    const Mat& A = step.tableau->A();
    const Index s = A.rows();
    const Mat stages = (dt * engine.K() * A.transpose()).colwise() + step.from.x;
    const auto linearise_stage = [&](Index i) {
      linearise(step.from.t + dt * step.tableau->c()[i], stages.col(i), engine.K().col(i), engine.Z().col(i));
    };
    const bool triangular = A.isLowerTriangular(0);
    Mat mu = Mat::Zero(N_, s);
    Vec result = lambda, sum = Vec::Zero(n_);
    if (triangular) {
      Mat xs = Mat::Zero(n_, s);  // (∂Fᵢ/∂x)ᵀ μᵢ
      for (Index j = s; j-- > 0;) {
        linearise_stage(j);
        Vec right = Vec::Zero(N_);
        right.head(n_) = dt * (step.tableau->b()[j] * lambda - xs * A.col(j));
        Mat M = inner_;
        M.leftCols(n_) += dt * A(j, j) * Fx_;
        mu.col(j) = solved(M.transpose(), right, step.from.t);
        xs.col(j) = Fx_.transpose() * mu.col(j);
        collect(mu.col(j));
      }
      return lambda - xs.rowwise().sum();
    }
    Mat M = Mat::Zero(s * N_, s * N_);
    Vec right = Vec::Zero(s * N_);
    for (Index i = 0; i < s; ++i) {
      linearise_stage(i);
      M.block(i * N_, i * N_, N_, N_) += inner_.transpose();
      for (Index j = 0; j < s; ++j) M.block(j * N_, i * N_, n_, N_) += dt * A(i, j) * Fx_.transpose();
      right.segment(i * N_, n_) = dt * step.tableau->b()[i] * lambda;
    }
    mu = solved(M, right, step.from.t).reshaped(N_, s);
    for (Index i = 0; i < s; ++i) {
      linearise_stage(i);
      result -= Fx_.transpose() * mu.col(i);
      collect(mu.col(i));
    }
    return result;
  }

  const Vec& gradient_so_far() const { return gradient_; }

 private:
  RungeKutta& engine_for(const TableauPtr& tableau) {
    auto& engine = engines_[tableau.get()];
    if (!engine) engine = std::make_unique<RungeKutta>(problem_, tableau);
    return *engine;
  }

  /// ∂F/∂x and ∂F/∂(x′, z) at a point.
  void linearise(double t, const Vec& x, const Vec& xdot, const Vec& z) {
    problem_->set_point(t, x.data(), xdot.data(), z.data());
    const std::vector<double>& J = problem_->jacobian();
    Fx_ = Mat::Zero(N_, n_);
    inner_ = Mat::Zero(N_, N_);
    for (std::size_t k = 0; k < J.size(); ++k) {
      const auto [row, column] = problem_->pattern()[k];
      if (column < n_)
        Fx_(row, column) = J[k];
      else
        inner_(row, column - n_) = J[k];
    }
  }

  /// dJ/dp -= (∂F/∂p)ᵀ μ at the point of the last linearisation.
  void collect(const Vec& mu) {
    if (parameter_entries_.empty()) return;
    const std::vector<double> values = by_parameters_(problem_->values());
    for (std::size_t k = 0; k < values.size(); ++k)
      gradient_[parameter_entries_[k].second] -= values[k] * mu[parameter_entries_[k].first];
  }

  ProblemPtr problem_;
  Index n_, N_;
  codegen::Kernel by_parameters_;
  std::vector<std::pair<int, int>> parameter_entries_;
  std::map<const Tableau*, std::unique_ptr<RungeKutta>> engines_;
  Mat Fx_, inner_;
  Vec gradient_;
};

}  // namespace

AdjointGradient adjoint_gradient(const ProblemPtr& problem, const std::vector<DiscreteStep>& steps,
                                 const Point& end, Expr cost, const std::vector<Expr>& parameters) {
  Sweep sweep(problem, parameters);
  if (!steps.empty() && !steps.back().modes.empty()) problem->set_modes(steps.back().modes);
  Vec lambda = sweep.finish(end, cost, parameters);
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    poll_interrupt();
    lambda = sweep.back(*step, lambda);
  }
  return {lambda, sweep.gradient_so_far()};
}

}  // namespace pendula::integrate
