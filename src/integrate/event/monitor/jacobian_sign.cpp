#include "integrate/event/monitor/jacobian_sign.hpp"

#include <algorithm>
#include <cmath>

namespace pendula::integrate {

constexpr int dense = 24;  // rows; smaller Jacobians are not worth a sparse factorisation
constexpr double log_of_zero = -1e300;

JacobianSign::JacobianSign(RankBlock& block)
    : block_(block),
      jacobian_(RankBlock::entries(block.block().jacobian), block.arguments()),
      numbers_(jacobian_.outputs()),
      rows_(block.block().jacobian.rows) {
  lu_.analyse(rows_, RankBlock::positions(block.block().jacobian),
              rows_ <= dense ? LinearSolver<double>::Factorisation::dense
                             : LinearSolver<double>::Factorisation::sparse);
  const double n = rows_;
  // cost of a determinant by dense elimination, or of the sparse one per entry, measured relative to kernels
  cost_ = static_cast<double>(jacobian_.operations()) +
          (rows_ <= dense ? 8 * n * n * n : 120.0 * static_cast<double>(jacobian_.outputs()));
}

void JacobianSign::start(const Point& point) {
  t_ = point.t;
  sign_ = determinant(point, log_);
  first_log_ = log_;
}

int JacobianSign::determinant(const Point& p, double& log) {
  jacobian_(block_.values(p), numbers_.data());
  if (lu_.factorise(numbers_.data())) return lu_.determinant(log);
  log = log_of_zero;
  return 0;
}

std::optional<Stop> JacobianSign::inspect(const Point& point, const SolutionBetween& between) {
  double log = 0;
  const int sign = determinant(point, log);
  std::optional<Stop> stop;
  if (sign != 0 && sign_ != 0) {
    const int samples = rows_ <= dense ? 7 : 1;
    Point p;
    for (int k = 1; k <= samples && !stop; ++k) {
      double here = 0;
      const double t = t_ + (point.t - t_) * k / (samples + 1);
      if (!RankBlock::reached(t, between, p)) break;
      if (const int other = determinant(p, here); other != 0 && other != sign_)
        stop = bisect(t, std::max(here, log), between);
    }
    if (!stop && sign != sign_) stop = bisect(point.t, log, between);
  }
  sign_ = sign;
  log_ = log;
  t_ = point.t;
  return stop;
}

std::optional<Stop> JacobianSign::bisect(double end, double end_log, const SolutionBetween& between) {
  double low = t_, high = end, log = end_log;
  Point p;
  for (int k = 0; k < 40 && high - low > 1e-14 * std::fabs(high); ++k) {
    const double middle = low + (high - low) / 2;
    const bool same = RankBlock::reached(middle, between, p) && determinant(p, log) == sign_;
    (same ? low : high) = middle;
  }
  if (!(log <= std::max(log_, end_log) + std::log(zero_size))) return {};
  const double t = low + (high - low) / 2;
  return Stop{t, block_.equations_lose(RankBlock::just_before(t, t_, between)) + RankBlock::remedy(), t_};
}

bool JacobianSign::almost_lost(const Point& point) {
  constexpr double almost = 0.1;  // of |det J| at the start
  double log = 0;
  return determinant(point, log) == 0 || log < first_log_ + std::log(almost);
}

}  // namespace pendula::integrate
