#include "integrate/solution/regrowth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pendula::integrate {

/// Of an error of one tolerance where the set was least: in tolerances, after it has grown.
static constexpr double admissible = 30;

RegrowthWatch::RegrowthWatch(const std::vector<std::vector<int>>& sets, Tolerances tolerances,
                             SmallStates small_states, bool events_jump)
    : tolerances_(std::move(tolerances)), small_states_(std::move(small_states)), events_jump_(events_jump) {
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

bool RegrowthWatch::crosses_zero(const Set& set, const Point& here) const {
  return std::any_of(set.states.begin(), set.states.end(), [&](int i) {
    return before_.x[i] < 0 ? here.x[i] > 0 : before_.x[i] > 0 && here.x[i] < 0;
  });
}

void RegrowthWatch::start(const Point& point, Stats& stats) {
  if (!sets_.empty()) before_ = point;
  stats.regrowth = small_states_.followed;
}

void RegrowthWatch::after_event(const Point& point) {
  if (sets_.empty() || !events_jump_) return;
  before_ = point;
  for (Set& set : sets_) set.is_small = false;
}

bool RegrowthWatch::ends_run(const Point& here, Stats& stats) {
  if (sets_.empty()) return false;
  const auto grown = std::find_if(sets_.begin(), sets_.end(),
                                  [&](Set& set) { return !set.is_ignored && follow(set, here); });
  before_ = here;
  if (grown == sets_.end()) return false;
  grown->is_ignored = true;
  const std::vector<int>& states = grown->states;
  const bool has_least = tolerances_.atol[states.front()] <= least_atol;
  using Effect = Regrowth::Effect;
  stats.regrowth = Regrowth{grown->t_least, states, has_least ? Effect::below_numbers : Effect::unknown};
  const std::vector<char>& may = small_states_.repeatable;
  return !may.empty() && std::all_of(states.begin(), states.end(), [&](int i) { return may[i] != 0; });
}

bool RegrowthWatch::follow(Set& set, const Point& here) {
  const double size = size_of(set, here), rtol = tolerances_.rtol[set.states.front()];
  const double small = 1 / (admissible * rtol);
  const bool crosses = crosses_zero(set, here);
  if (crosses && set.states.size() > 1 && !set.is_small && size >= small) {
    set.is_ignored = true;
    return false;
  }
  if (!set.is_small && !crosses && size >= small) return false;
  const double growth = growth_of(set, here);
  if (!set.is_small || (growth <= 0 && size <= set.least)) {
    set.is_small = true;
    set.least = size;
    set.t_least = here.t;
    set.growth = 0;
  } else {
    set.growth = std::max(0.0, set.growth + growth);
  }
  if (crosses) set.least = std::min(set.least, 1.0);
  // methods that damp what grows within a step keep x small where it would be large again
  const double grown = std::max(size, set.least * std::exp(set.growth));
  return grown / std::max(set.least, 1.0) > admissible * (1 + rtol * grown);
}

}  // namespace pendula::integrate
