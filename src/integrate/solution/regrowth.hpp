// States that fall below their tolerance and grow again: what is left of them there decides the rest, and
// that is an error.
//
// Where x′ = x g(t, …), an error δ of x grows as x does, δ′ = δ g. Below atol an error of atol is allowed;
// when x has grown G times from there, it is G atol, of which G/(1 + rtol |x|/atol) tolerances are seen. With
// x′ = (t - 12) x from x(0) = 1, x falls to 5·10⁻³² and is 1 again at t = 24; with atol = 10⁻⁹ every method
// ends 10¹⁷ away from it, or at 0. Steps that keep rtol alone follow x down to the smallest numbers.
#pragma once

#include <optional>
#include <vector>

#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/stats.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class RegrowthWatch : public StepMonitor {
 public:
  /// An atol with which rtol alone counts: 10¹⁸ of the smallest numbers.
  static constexpr double least_atol = 1e-290;

  /// sets: invariant_zeros() of the equations; events_jump: x may jump at an event. Cost after a step: some
  /// operations for each state of a set.
  RegrowthWatch(const std::vector<std::vector<int>>& sets, const Tolerances& tolerances,
                const std::vector<char>& repeatable, bool events_jump);

  void restart(const ProblemPtr& problem, const Point& point) override;
  /// Rejects a step that carries a state through 0 for which rtol alone counts.
  std::optional<Rejection> after(const ProblemPtr& problem, const Point& from, const Point& to) override;
  bool is_empty() const override { return sets_.empty(); }
  /// After an accepted step: notes the first set that has grown more than admissible, with stats. True where
  /// the run is to be repeated, all states of the set being repeatable (SmallStates).
  bool ends_run(const Point& from, const Point& to, Stats& stats);

 private:
  struct Set {
    std::vector<int> states;
    bool is_small = false;
    bool has_crossed = false;       ///< 0, since it is small, by an error
    double least = 0, t_least = 0;  ///< its size in tolerances where it was least since it became small
    double growth = 0;              ///< ∫ x′/x dt since then
  };
  double atol_of(const Set& set) const;  ///< the largest
  bool has_least_atol(const Set& set) const { return atol_of(set) <= least_atol; }
  double size_of(const Set& set, const Point& point) const;
  static double growth_of(const Set& set, const Point& from, const Point& to);
  enum class Course {
    open,
    grown,  ///< more than admissible
    swings  ///< through 0 while it is large: its states have no rtol of their own
  };
  Course follow(Set& set, const Point& from, const Point& to) const;

  std::vector<Set> sets_;
  Tolerances tolerances_;
  Vec small_;  ///< below which errors of one tolerance may be admissible no longer, once x grows
  std::vector<char> repeatable_;
  bool events_jump_;
};

}  // namespace pendula::integrate
