#include "integrate/solution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

void append(std::vector<double>& to, const Vec& values) { to.insert(to.end(), values.begin(), values.end()); }

Vec column(const std::vector<double>& from, int i, int size) {
  return Eigen::Map<const Vec>(from.data() + static_cast<std::ptrdiff_t>(i) * size, size);
}

}  // namespace

Solution::Solution(std::shared_ptr<RungeKutta> engine, double dt)
    : engine_(std::move(engine)), values_problem_(std::make_shared<Problem>(engine_->problem())), dt_(dt) {}

void Solution::save(const Point& point) {
  t_.push_back(point.t);
  append(x_, point.x);
  append(xdot_, point.xdot);
  append(z_, point.z);
}

void Solution::finish(std::string status, const Stats& stats, double seconds) {
  status_ = std::move(status);
  stats_ = stats;
  seconds_ = seconds;
}

Point Solution::point(int i) const {
  PENDULA_ASSERT(i >= 0 && i < size(), "a point outside the solution");
  const int n = problem().n();
  return {t_[static_cast<std::size_t>(i)], column(x_, i, n), column(xdot_, i, n),
          column(z_, i, problem().m())};
}

Point Solution::final() const {
  if (size() == 0)
    throw Error(text("the solution holds no points: ", status_, " before the first saved time"));
  return point(size() - 1);
}

Point Solution::at(double t) const {
  if (size() == 0) return final();  // throws
  const double rounding =
      4 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(t_.front()), std::fabs(t_.back()));
  if (!(t >= t_.front() - rounding && t <= t_.back() + rounding)) {
    throw Error(text("t = ", rounded(t), " lies outside the solution, which covers ", rounded(t_.front()),
                     " ≤ t ≤ ", rounded(t_.back())));
  }
  const auto after = std::upper_bound(t_.begin(), t_.end(), t + rounding);
  const int i = std::max(0, static_cast<int>(after - t_.begin()) - 1);
  Point here = point(i), next;
  while (t - here.t > rounding) {
    poll_interrupt();
    const double left = t - here.t;
    engine_->step(here, left < dt_ * (1 + 1e-9) ? left : dt_, next, false);
    std::swap(here, next);
  }
  return here;
}

const codegen::Kernel& Solution::kernel(std::span<const Expr> expressions) const {
  if (!std::equal(expressions.begin(), expressions.end(), compiled_.begin(), compiled_.end()) ||
      compiled_.empty()) {
    kernel_ = codegen::Kernel(expressions, problem().arguments());
    compiled_.assign(expressions.begin(), expressions.end());
  }
  return kernel_;
}

void Solution::evaluate(const codegen::Kernel& compiled, const Point& point, double* out) const {
  values_problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  compiled(values_problem_->values().data(), out);
}

Mat Solution::values(std::span<const Expr> expressions) const {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(
      size(), static_cast<Eigen::Index>(expressions.size()));
  const codegen::Kernel& compiled = kernel(expressions);
  for (int i = 0; i < size(); ++i) {
    poll_interrupt();
    evaluate(compiled, point(i), result.row(i).data());
  }
  return result;
}

Vec Solution::values(std::span<const Expr> expressions, double t) const {
  Vec result(static_cast<Eigen::Index>(expressions.size()));
  evaluate(kernel(expressions), at(t), result.data());
  return result;
}

std::string Solution::str() const {
  if (size() == 0) return "solution: " + status_ + "\n";
  Table table({false, false, true});
  const Point end = final();
  for (int i = 0; i < problem().n(); ++i) table.row({problem().x_name(i), "=", rounded(end.x[i])});
  for (int i = 0; i < problem().m(); ++i) table.row({problem().z_name(i), "=", rounded(end.z[i])});
  return text("solution by ", method().name(), ", dt = ", rounded(dt_, 6), ": ", stats_.steps,
              stats_.steps == 1 ? " step" : " steps", " from t = ", rounded(t_.front(), 6), " to ",
              rounded(end.t, 6), ", ", status_, "\n", table.str(2));
}

std::string Solution::stats_text() const {
  Table table({false, true});
  const auto row = [&](const char* what, long count) { table.row({what, std::to_string(count)}); };
  table.row({"method", method().name()});
  row("steps", stats_.steps);
  row("evaluations", stats_.evaluations);
  row("Jacobians", stats_.jacobians);
  row("factorisations", stats_.factorisations);
  row("Newton iterations", stats_.newton_iterations);
  return table.str();
}

}  // namespace pendula::integrate
