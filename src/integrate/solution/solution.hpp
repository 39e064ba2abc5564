// A computed trajectory: points at the saved times, and a continuous extension between them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/remembered.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solution/adjoint.hpp"
#include "integrate/solution/ending.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// Points one after another, t not decreasing: two points of one time are a jump.
class Points {
 public:
  Points(int n, int m) : n_(n), m_(m) {}
  void add(const Point& point);
  int size() const { return static_cast<int>(t_.size()); }
  int n() const { return n_; }
  int m() const { return m_; }
  std::size_t numbers() const { return t_.size() + x_.size() + xdot_.size() + z_.size(); }
  Point operator[](int i) const;
  void get(int i, Point& out) const;  ///< without allocation once `out` has its sizes
  const std::vector<double>& t() const { return t_; }
  void cut(double t);  ///< forgets the points behind t, but for the first one
  /// The last point at or before t (+ rounding).
  int index_at(double t, double rounding) const;

 private:
  int n_, m_;
  std::vector<double> t_, x_, xdot_, z_;
};

/// A border of piecewise equations: 0 = when, and how the run has treated it.
struct BorderInUse {
  Expr when;
  std::string treatment;  ///< "kink, located 3 times"
};

/// The continuous extension between the points.
class Continuation {
 public:
  virtual ~Continuation() = default;
  /// The times it knows about. Requires saved points.
  virtual std::pair<double, double> interval(const Points& saved) const {
    return {saved.t().front(), saved.t().back()};
  }
  /// The point at a time inside the interval. Throws Failure.
  virtual Point at(const Points& saved, double t) = 0;
  /// By how much the errors of doubtful steps exceed their estimates, in tolerances: the sum, which may end
  /// where it is beyond Stats::many_errors. Cost: of two steps for each doubtful one.
  virtual double errors_beyond_estimates() { return 0; }
  /// When the first step began in which errors of one tolerance grow to the size of the solution and the
  /// method damps them; nothing where there is none, or the model is large.
  virtual std::optional<double> passed_growth() { return {}; }
  /// The steps that were taken, for the adjoint. Throws Error where there is none: other methods than
  /// Runge–Kutta, states or derivatives that jump.
  virtual std::vector<DiscreteStep> steps() {
    throw Error("the adjoint needs the steps of a Runge–Kutta method; integrate with sensitivities = { … }");
  }
};

/// A root of an event function, and what was done about it.
struct EventRecord {
  double t = 0;
  int which = 0;  ///< number of the event, from 0
  std::string action;
  Point before, after;
};

/// From a time on, the solution was computed with these states (form "dummy").
struct StatesInUse {
  double t = 0;
  std::string states;
};

/// From a time on, the equations of this regime held: "x < la (index 3)".
struct RegimeInUse {
  double t = 0;
  std::string regime;
};

/// From a time on, the solution was computed by this method, which was chosen.
struct MethodInUse {
  double t = 0;
  std::string name, why;
};

/// The same expressions are asked for again and again.
struct KernelOfLastCall : Remembered {
  std::vector<Expr> expressions;
  codegen::Kernel kernel;   ///< of those arguments of the problem that the expressions contain
  std::vector<int> places;  ///< of these
  std::vector<double> arguments;

 private:
  void forget() override { expressions.clear(); }
};

class Solution {
 public:
  explicit Solution(ProblemPtr problem);

  // ── what the driver fills in ──
  void save(const Point& point) { points_.add(point); }
  void set_method(std::string name, double dt) {
    method_ = std::move(name);
    dt_ = dt;
  }
  void set_continuation(std::shared_ptr<Continuation> between) { between_ = std::move(between); }
  void add_event(EventRecord event) { events_.push_back(std::move(event)); }
  void set_borders(std::vector<BorderInUse> borders) { borders_ = std::move(borders); }
  void set_rounding(std::string remark) { rounding_ = std::move(remark); }
  void set_not_unique(std::string remark) { not_unique_ = std::move(remark); }
  void set_untested(std::string remark) { untested_ = std::move(remark); }
  /// For a solution that is restored, whose steps are not known.
  void set_passed_growth(std::optional<double> when) { passed_growth_.emplace(when); }
  void add_method(MethodInUse use) { methods_in_use_.push_back(std::move(use)); }
  void keep_methods(std::size_t count) { methods_in_use_.resize(count); }
  void cut(double t);  ///< takes back what was filled in behind t
  void add_states(StatesInUse use) { states_in_use_.push_back(std::move(use)); }
  void add_regime(RegimeInUse use) { regimes_in_use_.push_back(std::move(use)); }
  void finish(RunOutcome outcome, const Stats& stats, double seconds);

  const RunOutcome& outcome() const { return outcome_; }
  Ending ending() const { return outcome_.ending; }
  /// "finished", "event", "interrupted", or "stopped at t = 0.98: why".
  std::string status() const { return outcome_.text(); }
  bool finished() const { return outcome_.ending == Ending::finished; }
  const Stats& stats() const { return stats_; }
  /// The errors of the steps, in tolerances: their sum, in which doubtful steps have been judged.
  double errors() const;
  std::optional<double> passed_growth() const;     ///< see Continuation
  double cpu_seconds() const { return seconds_; }  ///< differs from run to run: shown on request only
  const Problem& problem() const { return *problem_; }
  /// d cost/dp for a number at the end of the run, and d cost/dx at its start (adjoint.hpp).
  AdjointGradient gradient(Expr cost, const std::vector<Expr>& parameters) const;
  const std::string& method_name() const { return method_; }
  double dt() const { return dt_; }  ///< 0: chosen step by step
  const std::vector<EventRecord>& events() const { return events_; }

  /// Which states were in use from when on; more than one where they were switched. Empty: always the same.
  const std::vector<StatesInUse>& states_in_use() const { return states_in_use_; }

  /// Regimes of a piecewise model whose index changes; empty for other models.
  const std::vector<RegimeInUse>& regimes_in_use() const { return regimes_in_use_; }

  /// Method "auto": what was chosen, when and why.
  const std::vector<MethodInUse>& methods_in_use() const { return methods_in_use_; }

  /// The borders of piecewise equations.
  const std::vector<BorderInUse>& borders() const { return borders_; }
  std::string regimes_text() const;  ///< one line each; of many, the last ones
  std::string borders_text() const;  ///< one line each; many are counted

  /// Why the digits asked for are not there; empty: nothing is known against them.
  const std::string& rounding() const { return rounding_; }
  const std::string& not_unique() const { return not_unique_; }  ///< see UniquenessCheck::at
  const std::string& untested() const { return untested_; }      ///< unknowns without an error test

  int size() const { return points_.size(); }
  const std::vector<double>& t() const { return points_.t(); }
  Point point(int i) const;  ///< 0 ≤ i < size()
  /// The last saved point. Throws Error if nothing was saved.
  Point final() const;

  /// The point at any time of the interval, by the method's continuous extension (fixed steps: by the method
  /// itself with a shortened step); at a jump the point after it. For index 0 and 1, x′ and z solve the
  /// equations there. Throws Error naming the interval if t lies outside.
  Point at(double t) const;

  /// Values of expressions in t, x, x′, z, u, p: one row per saved time, or at time t.
  /// Throws Error naming a leaf the solution does not know.
  Mat values(std::span<const Expr> expressions) const;
  Vec values(std::span<const Expr> expressions, double t) const;
  Vec values(std::span<const Expr> expressions, const Point& point) const;

  std::string str() const;         ///< method, interval, status, final values
  std::string stats_text() const;  ///< deterministic: without the time
  /// A line that says how far the errors of all steps may add up; "" where that is less than 100 tolerances.
  std::string errors_text() const;

 private:
  void compile(std::span<const Expr> expressions) const;
  void evaluate_last(const Point& point, double* out) const;
  std::string ending_reason() const;

  ProblemPtr problem_;
  std::shared_ptr<Problem> values_problem_;
  std::shared_ptr<Continuation> between_;
  RunOutcome outcome_;
  std::string method_;
  double dt_ = 0;
  Stats stats_;
  mutable std::optional<std::optional<double>> passed_growth_;  ///< known when it has been asked for
  mutable std::optional<double> beyond_estimates_;              ///< known when it has been asked for
  double seconds_ = 0;
  Points points_;
  std::vector<EventRecord> events_;
  std::vector<StatesInUse> states_in_use_;
  std::vector<RegimeInUse> regimes_in_use_;
  std::vector<MethodInUse> methods_in_use_;
  std::vector<BorderInUse> borders_;
  std::string rounding_, not_unique_, untested_;
  mutable KernelOfLastCall last_;
};

using SolutionPtr = std::shared_ptr<const Solution>;

}  // namespace pendula::integrate
