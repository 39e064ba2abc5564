#include "integrate/step/stepper.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/text.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/step_controller.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

double Stepper::fitted(double dt, double end) const { return fitted_step(dt, end - here_.t, limits_.dt_max); }

double Stepper::visible(double dt, double longest) const { return visible_step(dt, here_.t, longest); }

double Stepper::cautious_step(double end) const {
  ErrorSum size, slope;
  for (int i = 0; i < n(); ++i) {
    const double w = weight(i, std::fabs(here_.x[i]));
    size.add(here_.x[i] / w);
    slope.add(here_.xdot[i] / w);
  }
  const int count = std::max(1, n());
  return integrate::cautious_step(size.norm(count), slope.norm(count), here_.t,
                                  std::min(end - here_.t, limits_.dt_max));
}

bool Stepper::settle_again(RhsSolver& rhs) {
  constexpr double visible = 0.01, near = 1000;  // tolerances; a more distant solution may be another branch
  if (m() == 0) return false;
  Point there = here_;
  try {
    if (!rhs.settle(there)) return false;
  } catch (const Failure& f) {
    return false;
  }
  double largest = 0;
  for (int i = 0; i < m(); ++i) {
    const double size = std::max(std::fabs(here_.z[i]), std::fabs(there.z[i]));
    largest = std::max(largest, std::fabs(there.z[i] - here_.z[i]) / weight(n() + i, size));
  }
  if (!(largest > visible && largest <= near)) return false;
  here_ = there;
  return true;
}

void hermite(const StepView& step, double t, Point& out) {
  hermite(step.from, step.to, (t - step.from.t) / (step.to.t - step.from.t), out);
  out.t = t;
}

void Stepper::interpolate(const StepView& step, double t, Detail detail, Point& out) {
  if (detail == Detail::coarse || !(t > step.from.t && t < step.to.t)) {
    look(step, t, detail, out);
    return;
  }
  const unsigned version = problem_->version();
  for (const Look& known : looks_)
    if (known.detail >= detail && known.is_of(step, t, version)) {
      out = known.point;
      error_inside_ = known.error;
      return;
    }
  const Detail found = look(step, t, detail, out);
  looks_[oldest_look_] = {version, step.from.t, step.to.t, step.from.x, step.to.x, found, error_inside_, out};
  oldest_look_ = (oldest_look_ + 1) % looks_.size();
}

std::optional<bool> Stepper::project(Point& next) {
  if (!problem_->projects()) return false;
  try {
    return problem_->project_if_needed(next.t, next.x, tolerances_.rtol, tolerances_.atol,
                                       Problem::projection_share);
  } catch (const Failure& failure) {
    trouble_ = failure.what();
    return {};
  }
}

namespace {

/// The sign of det A; 0: singular, or too near for its sign to mean anything.
int sign_of_determinant(const Mat& A) {
  constexpr double rounding = 1e-13;  // 450 ε of the largest pivot
  const Eigen::PartialPivLU<Mat> lu(A);
  const Vec pivots = lu.matrixLU().diagonal();
  const Vec sizes = pivots.cwiseAbs();
  if (!pivots.allFinite() || !(sizes.minCoeff() > rounding * sizes.maxCoeff())) return 0;
  const auto negative = (pivots.array() < 0).count();
  const int permutation = static_cast<int>(lu.permutationP().determinant());
  return negative % 2 == 0 ? permutation : -permutation;
}

}  // namespace

bool Stepper::passes_growth(const StepView& step) {
  constexpr int small = 30;  // unknowns: two dense eliminations per look
  if (n() == 0 || n() + m() > small || problem_->has_dense_jacobian()) return false;
  const double rate = -std::log(tolerances_.rtol.head(n()).maxCoeff()) / (step.to.t - step.from.t);
  return grows(step.from, rate) && grows(step.to, rate);
}

/// Is an odd number of real eigenvalues of the linearised equations larger than `rate`?
bool Stepper::grows(const Point& at, double rate) {
  const Eigen::Index size = n() + m();
  Mat slopes = Mat::Zero(size, size), all = slopes;
  problem_->set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
  const std::vector<double>& values = problem_->jacobian();
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [row, column] = problem_->pattern()[k];
    if (column < n()) {
      all(row, column) += values[k] / rate;
    } else {
      slopes(row, column - n()) += values[k];
      all(row, column - n()) += values[k];
    }
  }
  return sign_of_determinant(slopes) * sign_of_determinant(all) < 0;
}

std::vector<double> Stepper::time_terms(double t, const double* y, const double* xdot) {
  const auto rows = static_cast<std::size_t>(n() + m());
  std::vector<double> terms(rows, 0.0), moved(rows);
  const double ahead = std::min(1e-6 * std::fabs(t), 1e-3 * std::fabs(dt_));
  if (!(t + ahead > t)) return terms;
  problem_->set_point(t + ahead, y, xdot, y + n());
  problem_->residual(moved.data());
  problem_->set_point(t, y, xdot, y + n());
  problem_->residual(terms.data());
  stats_.evaluations += 2;
  for (std::size_t k = 0; k < rows; ++k) {
    const double term = std::fabs((moved[k] - terms[k]) / ahead * t);
    terms[k] = std::isfinite(term) ? term : 0;
  }
  return terms;
}

Failure Stepper::vanished(const Eigen::Ref<const Vec>& error, const std::string& reason) const {
  int worst = -1;
  double largest = 0;
  for (int i = 0; i < error.size(); ++i) {
    const double size = std::isfinite(error[i]) ? std::fabs(error[i]) : std::numeric_limits<double>::max();
    if (size <= largest) continue;
    largest = size;
    worst = i;
  }
  std::string who;
  if (worst >= 0) {
    const double value = worst < n() ? here_.x[worst] : here_.z[worst - n()];
    who = text("; responsible: ", unknown_name(worst), " = ", rounded(value, 4));
    if (worst < here_.xdot.size() && std::isfinite(here_.xdot[worst]))
      who += text(", ", problem_->xdot_name(worst), " = ", rounded(here_.xdot[worst], 4));
  }
  const std::string why = reason.empty() ? "The solution is singular or not smooth here" : reason;
  const bool continues = std::islower(static_cast<unsigned char>(why[0])) && who.empty();
  return Failure(text("the step size fell below rounding", who, continues ? ": " : ". ", why));
}

}  // namespace pendula::integrate
