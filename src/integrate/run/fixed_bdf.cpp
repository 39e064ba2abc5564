#include "integrate/run/fixed_step_run.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "integrate/plan/run_monitors.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "method/collocation.hpp"

namespace pendula::integrate {
namespace {

/// F(t, x, (α₀x + rest)/(β₀Δt), z) = 0 in w = (x, z).
class BdfEquations : public Equations {
 public:
  BdfEquations(Problem& problem, Stats& stats) : problem_(problem), stats_(stats) {}
  void set(double t, double factor, const Vec& rest) {
    t_ = t;
    factor_ = factor;
    rest_ = rest;
  }

  void residual(const Vec& w, Vec& r) override {
    place(w);
    problem_.residual(r.data());
    ++stats_.evaluations;
  }
  void jacobian(const Vec& w, Mat& J, Vec& size) override {
    place(w);
    const int n = problem_.n();
    J.setZero();
    size.setZero();
    const std::vector<double>& values = problem_.jacobian();
    ++stats_.jacobians;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, column] = problem_.pattern()[k];
      if (column >= n && column < 2 * n) {
        J(row, column - n) += factor_ * values[k];
        size[row] += std::fabs(values[k] * rest_[column - n]);
      } else {
        J(row, column < n ? column : column - n) += values[k];
      }
    }
  }
  Vec velocity(const Vec& w) const { return factor_ * w.head(problem_.n()) + rest_; }

 private:
  void place(const Vec& w) {
    xdot_ = velocity(w);
    problem_.set_point(t_, w.data(), xdot_.data(), w.data() + problem_.n());
  }
  Problem& problem_;
  Stats& stats_;
  double t_ = 0, factor_ = 1;
  Vec rest_, xdot_;
};

/// The polynomial through neighbouring mesh points.
class MeshPolynomial : public Continuation {
 public:
  MeshPolynomial(ProblemPtr problem, int degree)
      : problem_(std::move(problem)),
        degree_(degree),
        mesh_(problem_->n(), problem_->m()),
        derivative_(problem_, unused_) {}
  void add(const Point& point) { mesh_.add(point); }
  void cut(double t) { mesh_.cut(t); }
  std::pair<double, double> interval(const Points&) const override {
    return {mesh_.t().front(), mesh_.t().back()};
  }

  Point at(const Points&, double t) override {
    const std::vector<double>& times = mesh_.t();
    const int i = mesh_.index_at(t, 0), last = mesh_.size() - 1;
    const int first = std::clamp(i + 1 - degree_, 0, std::max(0, last - degree_));
    const int end = std::min(first + degree_, last);
    Point out{t, Vec::Zero(problem_->n()), Vec::Zero(problem_->n()), Vec::Zero(problem_->m())}, node;
    for (int j = first; j <= end; ++j) {
      double factor = 1;
      for (int k = first; k <= end; ++k)
        if (k != j) factor *= (t - times[k]) / (times[j] - times[k]);
      mesh_.get(j, node);
      out.x += factor * node.x;
      out.xdot += factor * node.xdot;
      out.z += factor * node.z;
    }
    Point settled = out;
    if (derivative_(t, settled.x.data(), settled.xdot.data(), settled.z.data()) && derivative_.is_regular())
      return settled;
    return out;
  }

 private:
  ProblemPtr problem_;
  int degree_;
  Points mesh_;
  Stats unused_;
  RhsSolver derivative_;
};

class FixedBdf {
 public:
  FixedBdf(ProblemPtr problem, MultistepPtr method, const Plan& plan)
      : problem_(std::move(problem)), method_(std::move(method)), plan_(plan), equations_(*problem_, stats_) {
    const int stages = method_->steps() / 2 + 1;
    // With `direct` the weights at infinity must exist, as they do for Radau IIA. Models of index 1 take x′
    // and z from the last stage.
    starter_ = std::make_shared<RungeKutta>(
        problem_, std::make_shared<const Tableau>(radau(std::max(2, stages))), plan.direct);
    for (const mpq_class& a : method_->alpha()) alpha_.push_back(a.get_d() / method_->beta()[0].get_d());
  }

  const Stats& stats() const { return stats_; }
  RungeKutta& starter() { return *starter_; }

  void step(const Point& from, double t, double dt, Point& to) {
    const int k = method_->steps();
    if (history_.empty()) history_.push_back(from.x);
    if (static_cast<int>(history_.size()) < k) {
      starter_->step(from, dt, to, true);
      starter_->at_time(t);
    } else {
      implicit(from, t, dt, to);
    }
    to.t = t;
    ++stats_.steps;
    history_.insert(history_.begin(), to.x);
    if (static_cast<int>(history_.size()) > k) history_.pop_back();
  }

  void finish() {
    const Stats& more = starter_->stats();
    stats_.evaluations += more.evaluations;
    stats_.jacobians += more.jacobians;
    stats_.factorisations += more.factorisations;
    stats_.newton_iterations += more.newton_iterations;
  }

 private:
  void implicit(const Point& from, double t, double dt, Point& to) {
    const int n = problem_->n(), k = method_->steps();
    Vec rest = Vec::Zero(n);
    for (int i = 1; i <= k; ++i) rest += alpha_[i] * history_[i - 1];
    equations_.set(t, alpha_[0] / dt, rest / dt);
    Vec w(n + problem_->m());
    w << from.x + dt * from.xdot, from.z;
    NewtonResult result = newton_.solve(equations_, w);
    stats_.newton_iterations += result.iterations;
    stats_.factorisations += result.factorisations;
    if (!result.ok() && guess_without_motion(from, t, w)) result = newton_.solve(equations_, w);
    if (!result.ok())
      throw Failure(text("Newton did not converge (dt = ", rounded(dt, 6), ", ", result.iterations,
                         " iterations, ‖r‖ = ", rounded(result.residual, 3),
                         ", worst: ", problem_->equation_name(result.worst),
                         "). Try a smaller dt; the solution may also cease to exist here"));
    to.x = w.head(n);
    to.xdot = equations_.velocity(w);
    to.z = w.tail(problem_->m());
    if (problem_->projects()) problem_->project(t, to.x);
  }

  /// z at t for constant x: a source may jump within the step, and diodes switch with it.
  bool guess_without_motion(const Point& from, double t, Vec& w) {
    Point point{t, from.x, from.xdot, from.z};
    try {
      if (!RhsSolver(problem_, stats_).settle(point)) return false;
    } catch (const Failure&) {
      return false;
    }
    w << point.x, point.z;
    return true;
  }

  ProblemPtr problem_;
  MultistepPtr method_;
  Plan plan_;
  Stats stats_;
  BdfEquations equations_;
  Newton newton_;
  std::shared_ptr<RungeKutta> starter_;
  std::vector<double> alpha_;
  std::vector<Vec> history_;  ///< newest first
};

/// Steps of equal size that end exactly at the end of the interval.
RunOutcome run(FixedBdf& engine, MeshPolynomial& mesh, Solution& solution, Point here, const Plan& plan,
               FixedStepMonitors& monitors) {
  const double exact = (plan.to - plan.from) / *plan.dt;
  const long steps = std::max(1L, static_cast<long>(std::ceil(exact * (1 - dt_rounding))));
  const double dt = (plan.to - plan.from) / static_cast<double>(steps);
  Point next = here;
  try {
    for (long k = 1; k <= steps; ++k) {
      poll_interrupt();
      engine.step(here, k < steps ? plan.from + static_cast<double>(k) * dt : plan.to, dt, next);
      if (!next.x.allFinite() || !next.z.allFinite())
        throw Failure("the solution is not finite; try a smaller dt");
      if (const auto stop = monitors.after(here, next)) {
        solution.cut(stop->t);
        mesh.cut(stop->t);
        return stopped_at(*stop);
      }
      mesh.add(next);
      if (!plan.times) solution.save(next);
      std::swap(here, next);
      if (plan.progress && k % 16 == 0) plan.progress(here.t, engine.stats());
    }
  } catch (const Interrupted&) {
    return {Ending::interrupted, ""};
  } catch (const Failure& failure) {
    return stopped_at(here.t, failure.what() + monitors.near_singularity(here));
  }
  return {Ending::finished, ""};
}

}  // namespace

SolutionPtr integrate_bdf(ProblemPtr problem, MultistepPtr method, Point start, const Plan& plan) {
  check_fixed(plan, *problem);
  start = checked_start(std::move(start), *problem, plan.from);
  const std::clock_t begin = std::clock();
  FixedBdf engine(problem, method, plan);
  try {
    engine.starter().settle(start);
    engine.starter().require_determined(start);
  } catch (const Failure& failure) {
    if (!plan.direct) throw Failure(text("at the start, t = ", rounded(start.t, 6), ": ", failure.what()));
  }
  auto solution = std::make_shared<Solution>(problem);
  auto mesh = std::make_shared<MeshPolynomial>(problem, method->steps());
  solution->set_method(method->name(), *plan.dt);
  solution->set_continuation(mesh);
  mesh->add(start);
  if (!plan.times) solution->save(start);
  FixedStepMonitors monitors(problem, plan);
  monitors.start(start);
  RunOutcome outcome = run(engine, *mesh, *solution, start, plan, monitors);
  engine.finish();
  constexpr double rounding = 1e-12;  // of sums of steps: thousands of ε
  if (plan.times)
    for (double t : *plan.times)
      if (t <= mesh->interval(Points(0, 0)).second + rounding * std::fabs(plan.to))
        solution->save(mesh->at(Points(0, 0), t));
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  solution->finish(std::move(outcome), engine.stats(), seconds);
  return solution;
}

}  // namespace pendula::integrate
