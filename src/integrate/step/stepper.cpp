#include "integrate/step/stepper.hpp"

#include <cctype>
#include <cmath>

#include "base/text.hpp"

namespace pendula::integrate {

double Stepper::fitted(double dt, double end) const {
  const double left = end - here_.t;
  if (dt > limits_.dt_max) dt = limits_.dt_max;
  if (dt * 1.01 >= left) return left;    // the last step
  return dt * 2 > left ? left / 2 : dt;  // the last two: not one long and one tiny step
}

double Stepper::visible(double dt, double longest) const {
  return std::min(std::max(dt, 1e4 * std::numeric_limits<double>::epsilon() * std::fabs(here_.t)), longest);
}

double Stepper::cautious_step(double end) const {
  const double longest = std::min(end - here_.t, limits_.dt_max);
  ErrorSum size, slope;
  for (int i = 0; i < n(); ++i) {
    const double w = weight(i, std::fabs(here_.x[i]));
    size.add(here_.x[i] / w), slope.add(here_.xdot[i] / w);
  }
  const double d0 = size.norm(std::max(1, n())), d1 = slope.norm(std::max(1, n()));
  return visible(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 * std::max(1.0, longest) : 0.01 * d0 / d1, longest);
}

Failure Stepper::vanished(const Eigen::Ref<const Vec>& error, const std::string& reason) const {
  int worst = -1;
  double largest = 0;
  for (int i = 0; i < error.size(); ++i) {
    const double size = std::isfinite(error[i]) ? std::fabs(error[i]) : 1e300;
    if (size > largest) largest = size, worst = i;
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
