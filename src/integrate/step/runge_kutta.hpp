// The one engine for every Butcher tableau and every model of index 0 or 1.
//
// The stages of a step solve (Brenan, Campbell & Petzold, ch. 4; docs/derivations.md#irk)
//
//     F(tₖ + cᵢΔt,  xₖ + Δt Σⱼ aᵢⱼ Kⱼ,  Kᵢ,  zᵢ) = 0,   i = 1 … s,      xₖ₊₁ = xₖ + Δt Σᵢ bᵢ Kᵢ
//
// block by block of A: an explicit stage of an explicit ODE is one evaluation of f; a stage with aᵢᵢ ≠ 0, or
// any stage of a DAE, is one system in (Kᵢ, zᵢ); fully implicit stages are one coupled system r(w) = 0 in
// w = (K₁, z₁, …, Kₛ, zₛ) with the exact ∂r/∂w. x′ and z at mesh points solve F(tₖ, xₖ, x′, z) = 0, which is
// possible for index 1 only.
#pragma once

#include "base/error.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/newton.hpp"
#include "integrate/solve/stats.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// F at k coupled points: r(w) for w = (K₁, z₁, …, Kₖ, zₖ).
class StageEquations : public Equations {
 public:
  StageEquations(Problem& problem, Stats& stats) : problem_(problem), stats_(stats) {}

  /// k points at times t, states base.col(i) + Σⱼ coupling(i, j) Kⱼ. Shapes: t k, base n × k, coupling k × k.
  void set(const Vec& t, const Mat& base, const Mat& coupling);
  const Vec& times() const { return t_; }
  void residual(const Vec& w, Vec& r) override;
  void jacobian(const Vec& w, Mat& J, Vec& size) override;

 private:
  void place(const Vec& w, int i);
  Problem& problem_;
  Stats& stats_;
  Vec t_, x_;
  Mat base_, coupling_;
};

class RungeKutta {
 public:
  /// direct: do not ask for index 1; x′ and z at mesh points come from the stages by R(∞)
  /// (Hairer, Lubich & Roche, The Numerical Solution of DAEs by RK Methods, 1989, p. 14). Throws
  /// Error if the tableau cannot do that.
  RungeKutta(ProblemPtr problem, TableauPtr tableau, bool direct = false);

  /// Solves F(t, x, x′, z) = 0 for x′ and z, from the values in `point`. Throws Error naming the variables
  /// that are not determined (index above 1), Failure if Newton does not converge.
  void settle(Point& point);

  /// Throws the same Failure if ∂F/∂(x′, z) is singular at a settled point: x′ and z solve
  /// the equations, but not uniquely.
  void require_determined(const Point& point);

  /// One step; `from` must be settled. `remember`: the stages are the starting values of a step that
  /// continues this one. Throws Failure: what went wrong, without the time.
  void step(const Point& from, double dt, Point& to, bool remember);

  /// The last step ended at this time (the mesh avoids sums of rounded steps).
  void at_time(double t) { last_end_ = t; }

  const Problem& problem() const { return *problem_; }
  const Tableau& tableau() const { return *tableau_; }
  const Stats& stats() const { return stats_; }
  /// Of the last step: x′ (n × s) and z (m × s) of its stages.
  const Mat& K() const { return K_; }
  const Mat& Z() const { return Z_; }

 private:
  struct Block {
    int first, size;
  };
  void find_blocks();
  void prepare_weights();
  void guess(const Point& from, double dt, bool extrapolate);
  bool can_extrapolate(const Point& from, double dt) const;
  void solve_block(const Point& from, double dt, Block block);
  void solve_coupled(const Point& from, double dt, Block block);
  bool guess_at_stage_times(const Point& from, const Mat& base, const Vec& times);
  bool settle_with_continuation(Point& point);
  void evaluate_stage(const Point& from, double dt, int i);
  void complete(const Point& from, Point& to);
  NewtonResult newton(Vec& w);
  void require_finite(const Vec& x) const;
  [[noreturn]] void report(const NewtonResult& result, const std::string& where, double dt) const;
  [[noreturn]] void report_undetermined(const Mat& J) const;

  ProblemPtr problem_;
  TableauPtr tableau_;
  bool direct_;
  Stats stats_;
  std::vector<Block> blocks_;
  bool starts_explicit_, stiffly_accurate_;
  Mat extrapolation_;  ///< s × s: stage values of the next step from those of the last
  Vec end_weights_;    ///< s: the value at the end of the step
  Vec limit_weights_;  ///< s: bᵀA⁻¹, and R(∞) = 1 - Σ of it (direct only)
  StageEquations equations_;
  Newton newton_;
  Mat K_, Z_, last_K_, last_Z_;  ///< n × s, m × s
  double last_end_ = 0, last_dt_ = 0;
  Vec w_, base_, times_;
};

}  // namespace pendula::integrate
