#include "integrate/solution/regrowth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pendula::integrate {

/// Of an error of one tolerance where the set was least: in tolerances, after it has grown.
static constexpr double admissible = 30;

RegrowthWatch::RegrowthWatch(const std::vector<std::vector<int>>& sets, const Tolerances& tolerances,
                             const std::vector<char>& repeatable, bool events_jump)
    : events_jump_(events_jump) {
  if (sets.empty()) return;
  tolerances_ = tolerances;
  tolerances_.atol = tolerances_.atol.cwiseMax(least_atol);
  small_ = tolerances_.atol.cwiseQuotient(admissible * tolerances_.rtol);
  repeatable_ = repeatable;
  for (const std::vector<int>& states : sets) {
    sets_.emplace_back();
    sets_.back().states = states;
  }
}

double RegrowthWatch::atol_of(const Set& set) const {
  double atol = 0;
  for (const int i : set.states) atol = std::max(atol, tolerances_.atol[i]);
  return atol;
}

/// In tolerances.
double RegrowthWatch::size_of(const Set& set, const Point& point) const {
  double size = 0;
  for (const int i : set.states) size = std::max(size, std::fabs(point.x[i]) / tolerances_.atol[i]);
  return size;
}

/// ∫ x′/x dt over the step, of a set of one state.
double RegrowthWatch::growth_of(const Set& set, const Point& from, const Point& to) {
  if (set.states.size() > 1) return 0;
  const int i = set.states.front();
  const auto rate = [i](const Point& point) { return point.x[i] == 0 ? 0 : point.xdot[i] / point.x[i]; };
  return (to.t - from.t) * (rate(from) + rate(to)) / 2;
}

static bool crosses_zero(const std::vector<int>& states, const Point& from, const Point& to) {
  return std::any_of(states.begin(), states.end(),
                     [&](int i) { return from.x[i] < 0 ? to.x[i] > 0 : from.x[i] > 0 && to.x[i] < 0; });
}

void RegrowthWatch::restart(const ProblemPtr&, const Point&) {
  if (!events_jump_) return;
  for (Set& set : sets_) set.is_small = false;
}

std::optional<Rejection> RegrowthWatch::after(const ProblemPtr&, const Point& from, const Point& to) {
  for (const Set& set : sets_)
    if (set.states.size() == 1 && has_least_atol(set) && crosses_zero(set.states, from, to))
      return Rejection{};
  return {};
}

bool RegrowthWatch::ends_run(const Point& from, const Point& to, Stats& stats) {
  if (sets_.empty()) return false;
  bool ends = false;
  // what has grown, or swings, is watched no longer
  std::erase_if(sets_, [&](Set& set) {
    const Course course = follow(set, from, to);
    if (course == Course::grown) {
      using Effect = Regrowth::Effect;
      const bool is_least = has_least_atol(set);
      stats.regrowth =
          Regrowth{set.t_least, set.states, is_least ? Effect::below_numbers : Effect::unknown, atol_of(set)};
      ends = ends ||
             (!is_least && !repeatable_.empty() &&
              std::all_of(set.states.begin(), set.states.end(), [&](int i) { return repeatable_[i] != 0; }));
    }
    return course != Course::open;
  });
  return ends;
}

RegrowthWatch::Course RegrowthWatch::follow(Set& set, const Point& from, const Point& to) const {
  constexpr double visible = 3;     // growth from where it was least
  constexpr double certain = 1e30;  // atol, of what was below the smallest numbers: Newton errors are not
  const bool crosses = crosses_zero(set.states, from, to), is_single = set.states.size() == 1;
  const bool is_large = std::any_of(set.states.begin(), set.states.end(),
                                    [&](int i) { return std::fabs(to.x[i]) >= small_[i]; });
  if (is_large && !set.is_small && !crosses) return Course::open;
  if (is_large && !set.is_small && !is_single) return Course::swings;
  const double size = size_of(set, to), rtol = tolerances_.rtol[set.states.front()];
  // no solution passes 0: all of the state behind it is error
  const double allowed = 1 + rtol * std::max(size, size_of(set, from));
  if (crosses && is_single && !has_least_atol(set) && size > admissible * allowed) {
    set.t_least = to.t;
    return Course::grown;
  }
  const double growth = growth_of(set, from, to);
  set.has_crossed = crosses || (set.is_small && set.has_crossed);
  if (!set.is_small || (growth <= 0 && size <= set.least)) {
    set.is_small = true;
    set.least = size;
    set.t_least = to.t;
    set.growth = 0;
  } else {
    set.growth = std::max(0.0, set.growth + growth);
  }
  // methods that damp what grows within a step keep x small where it would be large again
  const double grown = std::max(size, set.least * std::exp(set.growth));
  const double error = set.has_crossed ? grown : grown / std::max(set.least, 1.0);
  const bool has_grown = is_single ? set.growth > std::log(visible) : size > visible * set.least;
  const bool is_visible = has_least_atol(set) ? size > certain : error > admissible * (1 + rtol * grown);
  return has_grown && is_visible ? Course::grown : Course::open;
}

}  // namespace pendula::integrate
