#include "integrate/step/runge_kutta.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/text.hpp"
#include "integrate/problem/rhs_solver.hpp"

namespace pendula::integrate {

void StageEquations::set(const Vec& t, const Mat& base, const Mat& coupling) {
  t_ = t;
  base_ = base;
  coupling_ = coupling;
}

void StageEquations::place(const Vec& w, int i) {
  const int n = problem_.n(), N = n + problem_.m();
  x_ = base_.col(i);
  for (int j = 0; j < t_.size(); ++j)
    if (coupling_(i, j) != 0) x_ += coupling_(i, j) * w.segment(j * N, n);
  const double* K = w.data() + i * N;
  problem_.set_point(t_[i], x_.data(), K, K + n);
}

void StageEquations::residual(const Vec& w, Vec& r) {
  const int N = problem_.n() + problem_.m();
  for (int i = 0; i < t_.size(); ++i, ++stats_.evaluations) {
    place(w, i);
    problem_.residual(r.data() + i * N);
  }
}

void StageEquations::jacobian(const Vec& w, Mat& J, Vec& size) {
  const int n = problem_.n(), N = n + problem_.m();
  J.setZero();
  size.setZero();
  for (int i = 0; i < t_.size(); ++i, ++stats_.jacobians) {
    place(w, i);
    const std::vector<double>& values = problem_.jacobian();
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, column] = problem_.pattern()[k];
      if (column >= n) {  // ∂F/∂(x′, z)
        J(i * N + row, i * N + column - n) += values[k];
        continue;
      }
      for (int j = 0; j < t_.size(); ++j) J(i * N + row, j * N + column) += coupling_(i, j) * values[k];
      size[i * N + row] += std::fabs(values[k] * x_[column]);
    }
  }
}

RungeKutta::RungeKutta(ProblemPtr problem, TableauPtr tableau, bool direct)
    : problem_(std::move(problem)),
      tableau_(std::move(tableau)),
      direct_(direct),
      starts_explicit_(tableau_->starts_explicit()),
      stiffly_accurate_(tableau_->is_stiffly_accurate()),
      equations_(*problem_, stats_) {
  find_blocks();
  prepare_weights();
  K_.setZero(problem_->n(), tableau_->stages());
  Z_.setZero(problem_->m(), tableau_->stages());
}

/// Finds the smallest diagonal blocks of A: stages first … first + size - 1 are coupled.
void RungeKutta::find_blocks() {
  const Mat& A = tableau_->A();
  const int s = tableau_->stages();
  for (int first = 0, end; first < s; first = end) {
    end = first + 1;
    while (end < s && !A.block(0, end, end, s - end).isZero(0)) ++end;
    blocks_.push_back({first, end - first});
  }
}

void RungeKutta::prepare_weights() {
  const int s = tableau_->stages();
  const Vec& c = tableau_->c();
  // A least-squares polynomial of degree ≤ 3 through the stages; a higher degree would amplify errors.
  const int terms = std::min(s, 4);
  const auto powers = [&](const Vec& at) {
    Mat V = Mat::Ones(at.size(), terms);
    for (int k = 1; k < terms; ++k) V.col(k) = V.col(k - 1).cwiseProduct(at);
    return V;
  };
  const Mat fit = pseudo_inverse(powers(c).completeOrthogonalDecomposition());
  extrapolation_ = powers(c + Vec::Ones(s)) * fit;
  end_weights_ = (powers(Vec::Ones(1)) * fit).transpose();
  if (!direct_) return;

  const Eigen::FullPivLU<Mat> lu(Mat(tableau_->A().transpose()));
  if (lu.isInvertible()) {
    limit_weights_ = lu.solve(tableau_->b());
  } else if (!stiffly_accurate_ || tableau_->is_explicit()) {
    throw Error(text(
        "the method ", tableau_->name(),
        " gives no z at the end of a step of a model of index 2 or more. Use rk.radau(2), rk.gauss(2) or ",
        "rk.implicit_euler, or reduce the model: sys:reduce():integrate{…}"));
  }
}

void RungeKutta::settle(Point& point) {
  const int n = problem_->n();
  if (problem_->is_ode()) {
    point.xdot.resize(n);
    problem_->set_point(point.t, point.x.data(), point.x.data(), nullptr);
    problem_->rhs(point.xdot.data());
    ++stats_.evaluations;
    for (int i = 0; i < n; ++i) {
      if (std::isfinite(point.xdot[i])) continue;
      throw Failure(text(problem_->xdot_name(i), " is not finite: the equations are not defined here"));
    }
    return;
  }
  w_.resize(n + problem_->m());
  w_ << point.xdot, point.z;
  equations_.set(Vec::Constant(1, point.t), point.x, Mat::Zero(1, 1));
  const NewtonResult result = newton(w_);
  if (result.outcome == Outcome::singular) report_undetermined(newton_.last_jacobian());
  if (!result.ok() && settle_with_continuation(point)) return;
  if (!result.ok()) report(result, "for x′ and z at the mesh point", 0);
  point.xdot = w_.head(n);
  point.z = w_.tail(problem_->m());
}

void RungeKutta::require_determined(const Point& point) {
  if (problem_->is_ode()) return;
  const int N = problem_->n() + problem_->m();
  w_.resize(N);
  w_ << point.xdot, point.z;
  equations_.set(Vec::Constant(1, point.t), point.x, Mat::Zero(1, 1));
  Mat J(N, N);
  Vec size(N);
  equations_.jacobian(w_, J, size);
  ++stats_.factorisations;
  if (!ScaledLU().factorise(J)) report_undetermined(J);
}

NewtonResult RungeKutta::newton(Vec& w) {
  const NewtonResult result = newton_.solve(equations_, w);
  stats_.newton_iterations += result.iterations;
  stats_.factorisations += result.factorisations;
  return result;
}

bool RungeKutta::can_extrapolate(const Point& from, double dt) const {
  constexpr double rounding = 1e-9;  // of dt: multiples of it err by ε t
  return last_dt_ > 0 && last_end_ == from.t && std::fabs(dt - last_dt_) <= rounding * dt;
}

/// Starting values of all stages: the polynomial of the last step continued, or the values at the mesh point.
void RungeKutta::guess(const Point& from, double dt, bool extrapolate) {
  if (extrapolate && can_extrapolate(from, dt)) {
    K_.noalias() = last_K_ * extrapolation_.transpose();
    Z_.noalias() = last_Z_ * extrapolation_.transpose();
  } else {
    K_.colwise() = from.xdot;
    Z_.colwise() = from.z;
  }
}

void RungeKutta::step(const Point& from, double dt, Point& to, bool remember) {
  guess(from, dt, true);
  for (const Block& block : blocks_) solve_block(from, dt, block);
  to.t = from.t + dt;
  to.x = from.x + dt * (K_ * tableau_->b());
  require_finite(to.x);
  if (problem_->projects()) problem_->project(to.t, to.x);
  complete(from, to);
  ++stats_.steps;
  if (!remember) return;
  last_K_ = K_;
  last_Z_ = Z_;
  last_dt_ = dt;
  last_end_ = to.t;
}

void RungeKutta::solve_block(const Point& from, double dt, Block block) {
  const int i = block.first;
  if (i == 0 && block.size == 1 && starts_explicit_) {
    K_.col(0) = from.xdot;
    Z_.col(0) = from.z;
  } else if (block.size == 1 && tableau_->A()(i, i) == 0 && problem_->is_ode()) {
    evaluate_stage(from, dt, i);
  } else {
    solve_coupled(from, dt, block);
  }
}

void RungeKutta::evaluate_stage(const Point& from, double dt, int i) {
  base_ = from.x;
  for (int j = 0; j < i; ++j)
    if (tableau_->A()(i, j) != 0) base_ += dt * tableau_->A()(i, j) * K_.col(j);
  problem_->set_point(from.t + tableau_->c()[i] * dt, base_.data(), base_.data(), nullptr);
  problem_->rhs(K_.col(i).data());
  ++stats_.evaluations;
  for (int k = 0; k < K_.rows(); ++k) {
    if (std::isfinite(K_(k, i))) continue;
    throw Failure(text(problem_->xdot_name(k), " is not finite in stage ", i + 1,
                       ". The solution may leave the domain of the ",
                       "equations or grow without bound; try a smaller dt"));
  }
}

void RungeKutta::solve_coupled(const Point& from, double dt, Block block) {
  const int n = problem_->n(), N = n + problem_->m(), k = block.size, first = block.first;
  const Mat& A = tableau_->A();
  const Mat known = K_.leftCols(first) * A.block(first, 0, k, first).transpose();  // n × k
  Mat base = dt * known;
  base.colwise() += from.x;
  equations_.set(Vec::Constant(k, from.t) + dt * tableau_->c().segment(first, k), base,
                 dt * A.block(first, first, k, k));
  w_.resize(k * N);
  const auto from_columns = [&](int i, const auto& xdot, const auto& z) { w_.segment(i * N, N) << xdot, z; };
  for (int i = 0; i < k; ++i) from_columns(i, K_.col(first + i), Z_.col(first + i));
  NewtonResult result = newton(w_);
  if (!result.ok() && can_extrapolate(from, dt)) {  // the extrapolation may be poor; the mesh point seldom is
    for (int i = 0; i < k; ++i) from_columns(i, from.xdot, from.z);
    result = newton(w_);
  }
  if (!result.ok() && guess_at_stage_times(from, base, equations_.times())) result = newton(w_);
  if (!result.ok()) {
    const std::string where =
        k > 1 ? text("in stages ", first + 1, " to ", first + k) : text("in stage ", first + 1);
    report(result, tableau_->stages() > 1 ? where : "", dt);
  }
  for (int i = 0; i < k; ++i) {
    K_.col(first + i) = w_.segment(i * N, n);
    Z_.col(first + i) = w_.segment(i * N + n, N - n);
  }
}

/// x′ and z of the stages for constant x: a source may jump within the step, and diodes switch with it.
bool RungeKutta::guess_at_stage_times(const Point& from, const Mat& base, const Vec& times) {
  if (direct_ || problem_->is_ode()) return false;
  const Eigen::Index n = problem_->n(), N = n + problem_->m();
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    Point point{times[i], base.col(i), from.xdot, from.z};
    if (!settle_with_continuation(point)) return false;
    w_.segment(i * N, N) << point.xdot, point.z;
  }
  return true;
}

bool RungeKutta::settle_with_continuation(Point& point) {
  try {
    return RhsSolver(problem_, stats_).settle(point);
  } catch (const Failure&) {
    return false;
  }
}

/// Computes x′ and z at the new point.
void RungeKutta::complete(const Point& from, Point& to) {
  if (stiffly_accurate_ && !problem_->projects()) {  // the last stage is F(tₖ₊₁, xₖ₊₁, x′, z) = 0
    to.xdot = K_.rightCols(1);
    to.z = Z_.rightCols(1);
  } else if (direct_) {
    const double at_infinity = 1 - limit_weights_.sum();
    to.xdot = at_infinity * from.xdot + K_ * limit_weights_;
    to.z = at_infinity * from.z + Z_ * limit_weights_;
  } else {
    to.xdot = K_ * end_weights_;
    to.z = Z_ * end_weights_;
    settle(to);
  }
}

void RungeKutta::require_finite(const Vec& x) const {
  for (int i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i])) {
      throw Failure(text(problem_->x_name(i),
                         " is not finite. The solution may grow without bound here, or dt is too ",
                         "large for this method"));
    }
}

void RungeKutta::report(const NewtonResult& result, const std::string& where, double dt) const {
  const int N = problem_->n() + problem_->m();
  const std::string place = where.empty() ? "" : " " + where;
  const std::string equation = problem_->equation_name(result.worst % N);
  if (result.outcome == Outcome::not_finite) {
    throw Failure(text("the equations are not finite", place, " (", equation,
                       "). The solution may leave their domain; try a smaller dt"));
  }
  const std::string how =
      result.outcome == Outcome::singular ? "met a singular iteration matrix" : "did not converge";
  const std::string step = dt > 0 ? text("dt = ", rounded(dt, 6), ", ") : "";
  throw Failure(text("Newton ", how, place, " (", step, result.iterations,
                     result.iterations == 1 ? " iteration" : " iterations",
                     ", ‖r‖ = ", rounded(result.residual, 3), ", worst: ", equation,
                     "). Try a smaller dt; the solution may also cease to exist here"));
}

void RungeKutta::report_undetermined(const Mat& J) const {
  Vec right, left;
  ScaledLU::null_vectors(J, right, left);
  constexpr double visible =
      1e-6;  // relative to the largest component; above the rounding of an exact null vector
  std::vector<std::string> unknowns, equations;
  for (int j = 0; j < right.size(); ++j) {
    if (std::fabs(right[j]) < visible) continue;
    unknowns.push_back(j < problem_->n() ? problem_->xdot_name(j) : problem_->z_name(j - problem_->n()));
  }
  for (int i = 0; i < left.size(); ++i)
    if (std::fabs(left[i]) >= visible) equations.push_back(problem_->equation_name(i));
  throw Failure(
      text("the equations do not determine ", join(unknowns, ", "), " (", join(equations, "; "),
           equations.size() == 1 ? " does" : " do",
           " not restrict them): the index is above 1, or this point is singular. Reduce the index first: ",
           "sys:reduce():integrate{…}"));
}

}  // namespace pendula::integrate
