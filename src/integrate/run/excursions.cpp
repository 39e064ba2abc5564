#include "integrate/run/excursions.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {

void Excursions::watch(std::vector<char> unfrozen) {
  unfrozen_ = std::move(unfrozen);
  any_ = std::find(unfrozen_.begin(), unfrozen_.end(), 1) != unfrozen_.end();
  finder_.reset();
  gradients_.clear();
  if (!any_) return;
  finder_.emplace(state_.problem, state_.plan.events.list);
  finder_->set_interval(state_.plan.from, state_.plan.to);
}

bool Excursions::in_last_step() {
  constexpr long few = 20;
  if (!any_ || (repeated_ > few && repeated_ > state_.stats().steps)) return false;
  EventFinder& finder = *finder_;
  std::vector<int> candidates;
  for (std::size_t i = 0; i < unfrozen_.size(); ++i)
    if (unfrozen_[i]) candidates.push_back(static_cast<int>(i));
  finder.ignore_all_but(candidates);
  finder.start(state_.view.to);
  const std::vector<double> there = finder.values();
  finder.start(state_.view.from);
  std::erase_if(candidates, [&](int i) { return !(there[i] * finder.side(i) > 0); });
  if (candidates.empty()) return false;
  finder.ignore_all_but(candidates);
  finder.start(state_.view.from);
  bool missed = false;
  try {
    if (!finder.find(state_.stepper(), state_.view)) return false;
    finder.ignore_all_but({});
    missed = std::any_of(candidates.begin(), candidates.end(), [&](int border) { return is_deep(border); });
  } catch (const Failure&) {  // z is unknown inside the step: the solution may have been anywhere
    missed = true;
  }
  repeated_ += missed;
  return missed;
}

/// Is the solution, midway between two crossings, farther beyond the border than its error? Requires that
/// finder_ ignores all borders.
bool Excursions::is_deep(int border) {
  constexpr int most = 20;  // excursions; with more the solution oscillates about the border
  EventFinder& finder = *finder_;
  finder.ignore(border, false);
  finder.start(state_.view.from);
  const double uncertain = uncertainty(border);
  bool deep = false;
  for (int visit = 0; visit < most && !deep; ++visit) {
    const auto there = finder.find(state_.stepper(), state_.view);
    if (!there) break;
    finder.pass(*there, state_.stepper(), state_.view);
    const auto back = finder.find(state_.stepper(), state_.view);
    const double halfway = (there->t + (back ? back->t : state_.view.to.t)) / 2;
    deep = !(std::fabs(finder.value(state_.stepper(), state_.view, border, halfway)) <= uncertain);
    if (!back) break;
    finder.pass(*back, state_.stepper(), state_.view);
  }
  finder.ignore(border);
  return deep;
}

/// Error of the surface function by the tolerances of x and z; 0 if it contains x′.
double Excursions::uncertainty(int border) {
  Problem& problem = *state_.problem;
  const dae::FirstOrder& model = problem.model();
  const Expr when = state_.plan.events.list[border].when;
  for (Expr leaf : leaves({&when, 1}))
    if (std::find(model.xdot.begin(), model.xdot.end(), leaf) != model.xdot.end()) return 0;
  std::vector<Expr> unknowns = model.x;
  unknowns.insert(unknowns.end(), model.z.begin(), model.z.end());
  codegen::Kernel& gradient = gradients_[border];
  if (gradient.outputs() == 0)
    gradient = codegen::Kernel(pendula::gradient(when, unknowns), problem.arguments());
  const Point& point = state_.view.to;
  problem.set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::vector<double> slopes(unknowns.size());
  gradient(problem.values().data(), slopes.data());
  const Tolerances& tolerances = state_.plan.tolerances;
  double sum = 0;
  for (Eigen::Index i = 0; i < tolerances.atol.size() && i < static_cast<Eigen::Index>(slopes.size()); ++i) {
    const double size = std::fabs(i < point.x.size() ? point.x[i] : point.z[i - point.x.size()]);
    sum += std::fabs(slopes[i]) * (tolerances.atol[i] + tolerances.rtol[i] * size);
  }
  return sum;
}

}  // namespace pendula::integrate
