#include "integrate/solution/rounding_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {
namespace {

/// The matrix M/h + J at a point.
class StepMatrix {
 public:
  StepMatrix(Problem& problem, const Point& at) : entries_(at_point(problem, at)), values_(entries_.size()) {
    const int n = problem.n();
    for (const Problem::Entry& e : problem.pattern()) {
      in_mass_.push_back(e.column >= n && e.column < 2 * n);
      positions_.push_back({e.row, e.column < n ? e.column : e.column - n});
    }
    solver_.analyse(n + problem.m(), positions_);
  }
  bool factorise(double h) {
    h_ = h;
    for (std::size_t k = 0; k < values_.size(); ++k) values_[k] = in_mass_[k] ? entries_[k] / h : entries_[k];
    return solver_.factorise(values_.data());
  }
  /// e ← A⁻¹ M e/h: a step of the implicit Euler method.
  void carry(std::vector<double>& e) {
    std::vector<double> right(e.size(), 0.0);
    for (std::size_t k = 0; k < values_.size(); ++k)
      if (in_mass_[k]) right[positions_[k].row] += entries_[k] / h_ * e[positions_[k].column];
    solver_.solve(right.data());
    e = right;
  }
  /// A⁻¹ (F(y + δ) - F(y) - J δ) for δ of a few units in the last place: the effect of the rounding errors of
  /// a residual. Terms that several rows share contribute the same error to all of them.
  std::vector<double> rounding(Problem& problem, const Point& at) {
    const auto size = static_cast<std::size_t>(problem.n() + problem.m());
    std::vector<double> before(size), after(size);
    problem.set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
    problem.residual(before.data());
    std::vector<double> shift;
    std::uint32_t random = 1;
    double* y = problem.unknowns();
    for (std::size_t k = 0; k < size + static_cast<std::size_t>(problem.n()); ++k) {
      random = random * 1664525u + 1013904223u;
      const double moved = y[k] * (1 + eps * (static_cast<double>(random >> 28) - 7.5));
      shift.push_back(moved - y[k]);
      y[k] = moved;
    }
    problem.residual(after.data());
    for (std::size_t k = 0; k < size; ++k) after[k] -= before[k];
    for (std::size_t k = 0; k < entries_.size(); ++k) {
      const Problem::Entry& e = problem.pattern()[k];
      after[e.row] -= entries_[k] * shift[e.column];
    }
    solver_.solve(after.data());
    return after;
  }

 private:
  static const std::vector<double>& at_point(Problem& problem, const Point& at) {
    problem.set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
    return problem.jacobian();
  }
  std::vector<double> entries_, values_;
  std::vector<Position> positions_;
  std::vector<char> in_mass_;
  LinearSolver<double> solver_;
  double h_ = 0;
};

}  // namespace

RoundingWatch::RoundingWatch(const Problem& problem, const Tolerances& tolerances,
                             const std::vector<int>& variable_index, bool everywhere)
    : tolerances_(tolerances), next_(everywhere ? 1 : 8) {
  constexpr int many = 300;
  constexpr double tight = 1e-7;
  const int size = problem.n() + problem.m();
  const bool low_index =
      std::all_of(variable_index.begin(), variable_index.end(), [](int i) { return i == 1; });
  active_ = low_index && size > 0 && size <= many && !problem.has_dense_jacobian() &&
            tolerances.rtol.size() == size && (everywhere || tolerances.rtol.minCoeff() < tight);
}

void RoundingWatch::after(Problem& problem, const Point& before, const Point& here, long steps) {
  constexpr int parts = 8;  // of the time since the last inspection: (1 + λ Δ/8)⁻⁸ for e^(-λ Δ)
  const auto size = static_cast<std::size_t>(problem.n() + problem.m());
  next_ = 2 * steps;
  StepMatrix matrix(problem, here);
  if (!error_.empty() && matrix.factorise((here.t - t_) / parts))
    for (int k = 0; k < parts; ++k) matrix.carry(error_);
  error_.resize(size, 0.0);
  if (matrix.factorise(here.t - before.t)) {
    const std::vector<double> fresh = matrix.rounding(problem, here);
    const double many = std::sqrt(static_cast<double>(steps - last_));  // independent errors
    for (std::size_t k = 0; k < size; ++k) error_[k] += many * fresh[k];
  }
  t_ = here.t;
  last_ = steps;
}

std::string RoundingWatch::remark(Problem& problem, const Point& end) const {
  constexpr double harmless = 10;  // tolerances
  if (error_.empty()) return "";
  const Eigen::Index n = problem.n();
  Vec y(n + problem.m());
  y << end.x, end.z;
  const Vec open = Eigen::Map<const Vec>(error_.data(), y.size()).cwiseAbs();
  Eigen::Index worst = 0;
  const Vec weights = tolerances_.atol + tolerances_.rtol.cwiseProduct(y.cwiseAbs());
  if (!(open.cwiseQuotient(weights).maxCoeff(&worst) > harmless)) return "";
  const int k = static_cast<int>(worst);
  return text("rounding errors of the equations leave ",
              k < n ? problem.x_name(k) : problem.z_name(k - problem.n()), " = ", rounded(y[worst], 3),
              " uncertain by about ", rounded(open[worst], 1),
              ": there are not as many digits as rtol and atol ask for");
}

}  // namespace pendula::integrate
