// A computed trajectory: points at the saved times, and between them by steps of the same method.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integrate/runge_kutta.hpp"

namespace pendula::integrate {

class Solution {
 public:
  Solution(std::shared_ptr<RungeKutta> engine, double dt);

  // ── what the driver fills in ──
  void save(const Point& point);
  void finish(std::string status, const Stats& stats, double seconds);

  /// "finished", "interrupted", or "stopped at t = 0.98: why".
  const std::string& status() const { return status_; }
  bool finished() const { return status_ == "finished"; }
  const Stats& stats() const { return stats_; }
  double cpu_seconds() const { return seconds_; }  ///< differs from run to run: shown on request only
  const Problem& problem() const { return engine_->problem(); }
  const Tableau& method() const { return engine_->tableau(); }
  double dt() const { return dt_; }

  int size() const { return static_cast<int>(t_.size()); }
  const std::vector<double>& t() const { return t_; }
  Point point(int i) const;  ///< 0 ≤ i < size()
  /// The last saved point. Throws Error if nothing was saved.
  Point final() const;

  /// The point at any time of the interval. Between saved times the method continues from the last saved time
  /// with steps dt and a shortened last one: as accurate as the mesh itself, and x′, z solve the equations.
  /// Throws Error naming the interval if t lies outside.
  Point at(double t) const;

  /// Values of expressions in t, x, x′, z, u, p: one row per saved time, or at time t.
  /// Throws Error naming a leaf the solution does not know.
  Mat values(std::span<const Expr> expressions) const;
  Vec values(std::span<const Expr> expressions, double t) const;

  std::string str() const;         ///< method, interval, status, final values
  std::string stats_text() const;  ///< deterministic: without the time

 private:
  const codegen::Kernel& kernel(std::span<const Expr> expressions) const;
  void evaluate(const codegen::Kernel& kernel, const Point& point, double* out) const;

  std::shared_ptr<RungeKutta> engine_;
  std::shared_ptr<Problem> values_problem_;
  double dt_;
  std::string status_ = "not started";
  Stats stats_;
  double seconds_ = 0;
  std::vector<double> t_, x_, xdot_, z_;  ///< points one after another
  mutable std::vector<Expr>
      compiled_;  ///< what kernel_ computes: the same expressions are asked for again and again
  mutable codegen::Kernel kernel_;
};

using SolutionPtr = std::shared_ptr<const Solution>;

}  // namespace pendula::integrate
