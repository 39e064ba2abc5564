#include "integrate/run/explicit_forecast.hpp"

#include <algorithm>
#include <utility>

namespace pendula::integrate {

void ExplicitForecast::begin(const Progress& now, double accurate, long apart) {
  accurate_ = accurate;
  few_ = apart;
  last_ = now;
  apart_ = few_;
  next_ = now.steps + few_;
  on_trial_ = has_grown_ = false;
  longest_ = 0;
  radius_.reset();
  restart();
}

void ExplicitForecast::step(double dt) {
  constexpr double grown = 1.2;  // steps that differ by less have one size
  if (dt <= grown * longest_) return;
  longest_ = dt;
  has_grown_ = true;
}

void ExplicitForecast::restart() {
  time_ = steps_ = spent_ = 0;
  implicit_ = 0;
}

/// Halves the sums, so that the recent part of a long stretch has the largest weight.
void ExplicitForecast::forget() {
  time_ /= 2;
  steps_ /= 2;
  spent_ /= 2;
  implicit_ /= 2;
}

std::optional<double> ExplicitForecast::radius_at(const ProblemPtr& problem, const Point& here) {
  if (problem_ != problem) {
    problem_ = problem;
    derivative_ = std::make_unique<RhsSolver>(problem, unused_);
  }
  Point at = here;
  if (!(*derivative_)(at.t, at.x.data(), at.xdot.data(), at.z.data()) || !derivative_->is_regular())
    return {};
  return spectrum_.at(*derivative_, at);
}

void ExplicitForecast::measure(const ProblemPtr& problem, const Point& here, const Progress& now) {
  constexpr double hopeless = 4;  // times the work of the implicit steps
  constexpr long long_stretch = 64, seldom = 32;
  const long steps = now.steps - last_.steps;
  const double elapsed = here.t - t_, work = now.work - last_.work;
  const bool begins = !radius_;
  const double radius_before = radius_.value_or(0);
  radius_ = radius_at(problem, here);
  last_ = now;
  t_ = here.t;
  const double stable = (radius_.value_or(0) + radius_before) / 2 * elapsed / settled_;
  const double accurate = accurate_ * static_cast<double>(steps);
  if (!radius_ || (!begins && stable > hopeless * work)) {
    restart();
    apart_ = std::min(2 * apart_, seldom);
  } else if (!begins) {
    time_ += elapsed;
    steps_ += std::max(stable, accurate);
    spent_ += work;
    implicit_ += steps;
    apart_ = implicit_ < enough_ ? few_ : std::min(2 * apart_, seldom);
    if (implicit_ > std::max(long_stretch, 2 * enough_)) forget();
  }
  if (begins || has_grown_) {
    restart();
    has_grown_ = false;
  }
  next_ = now.steps + apart_;
}

bool ExplicitForecast::is_less_work(double left) {
  constexpr double clearly = 1.5, price = 25;  // in explicit steps: the cost of a change of the method
  if (implicit_ < enough_) return false;
  if (std::exchange(on_trial_, false)) return (counted_ > 0 ? counted_ * time_ : steps_) <= spent_;
  return clearly * steps_ <= spent_ && (spent_ - steps_) * left >= price * time_;
}

}  // namespace pendula::integrate
