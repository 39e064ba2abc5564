#include "integrate/solution/regrowth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pendula::integrate {

/// Of an error of one tolerance where the set was least: in tolerances, after it has grown.
static constexpr double admissible = 30;

RegrowthWatch::RegrowthWatch(const std::vector<std::vector<int>>& sets, Tolerances tolerances,
                             std::vector<char> repeatable, bool events_jump)
    : tolerances_(std::move(tolerances)), repeatable_(std::move(repeatable)), events_jump_(events_jump) {
  tolerances_.atol = tolerances_.atol.cwiseMax(least_atol);
  for (const std::vector<int>& states : sets) {
    sets_.emplace_back();
    sets_.back().states = states;
  }
}

/// In tolerances.
double RegrowthWatch::size_of(const Set& set, const Point& point) const {
  double size = 0;
  for (const int i : set.states) size = std::max(size, std::fabs(point.x[i]) / tolerances_.atol[i]);
  return size;
}

/// ∫ x′/x dt over the step, of a set of one state.
double RegrowthWatch::growth_of(const Set& set, const Point& here) const {
  if (set.states.size() > 1) return 0;
  const int i = set.states.front();
  const auto rate = [i](const Point& point) { return point.x[i] == 0 ? 0 : point.xdot[i] / point.x[i]; };
  return (here.t - before_.t) * (rate(before_) + rate(here)) / 2;
}

static bool crosses_zero(const std::vector<int>& states, const Point& from, const Point& to) {
  return std::any_of(states.begin(), states.end(),
                     [&](int i) { return from.x[i] < 0 ? to.x[i] > 0 : from.x[i] > 0 && to.x[i] < 0; });
}

void RegrowthWatch::restart(const ProblemPtr&, const Point& point) {
  if (sets_.empty()) return;
  const bool begins = before_.x.size() == 0;
  if (!begins && !events_jump_) return;
  before_ = point;
  for (Set& set : sets_) set.is_small = false;
}

std::optional<Rejection> RegrowthWatch::after(const ProblemPtr&, const Point& from, const Point& to) {
  for (const Set& set : sets_)
    if (set.states.size() == 1 && has_least_atol(set) && crosses_zero(set.states, from, to))
      return Rejection{};
  return {};
}

bool RegrowthWatch::ends_run(const Point& here, Stats& stats) {
  if (sets_.empty()) return false;
  const auto grown = std::find_if(sets_.begin(), sets_.end(),
                                  [&](Set& set) { return !set.is_ignored && follow(set, here); });
  before_ = here;
  if (grown == sets_.end()) return false;
  grown->is_ignored = true;
  const std::vector<int>& states = grown->states;
  using Effect = Regrowth::Effect;
  stats.regrowth =
      Regrowth{grown->t_least, states, has_least_atol(*grown) ? Effect::below_numbers : Effect::unknown};
  return !repeatable_.empty() &&
         std::all_of(states.begin(), states.end(), [&](int i) { return repeatable_[i] != 0; });
}

bool RegrowthWatch::follow(Set& set, const Point& here) {
  constexpr double visible = 3;     // growth from where it was least
  constexpr double certain = 1e30;  // atol, of what was below the smallest numbers: Newton errors are not
  const double size = size_of(set, here), rtol = tolerances_.rtol[set.states.front()];
  const double small = 1 / (admissible * rtol);
  const bool crosses = crosses_zero(set.states, before_, here), is_single = set.states.size() == 1;
  if (crosses && !is_single && !set.is_small && size >= small) {
    set.is_ignored = true;
    return false;
  }
  if (!set.is_small && !crosses && size >= small) return false;
  // no solution passes 0: all of the state behind it is error
  const double allowed = 1 + rtol * std::max(size, size_of(set, before_));
  if (crosses && is_single && !has_least_atol(set) && size > admissible * allowed) {
    set.t_least = here.t;
    return true;
  }
  const double growth = growth_of(set, here);
  set.has_crossed = crosses || (set.is_small && set.has_crossed);
  if (!set.is_small || (growth <= 0 && size <= set.least)) {
    set.is_small = true;
    set.least = size;
    set.t_least = here.t;
    set.growth = 0;
  } else {
    set.growth = std::max(0.0, set.growth + growth);
  }
  // methods that damp what grows within a step keep x small where it would be large again
  const double grown = std::max(size, set.least * std::exp(set.growth));
  const double error = set.has_crossed ? grown : grown / std::max(set.least, 1.0);
  const bool has_grown = is_single ? set.growth > std::log(visible) : size > visible * set.least;
  return has_grown && (has_least_atol(set) ? size > certain : error > admissible * (1 + rtol * grown));
}

}  // namespace pendula::integrate
