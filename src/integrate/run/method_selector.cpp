#include "integrate/run/method_selector.hpp"

#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/run/methods.hpp"

namespace pendula::integrate {

MethodSelector::MethodSelector(AdaptiveState& state, const Method& method)
    : state_(state), method_(method), couplings_(DependencyGraph::of(*state.problem, state.plan.modes)) {}

void MethodSelector::start(const Point& point) {
  const Choice choice = is_automatic() ? choose(state_.problem, method_, state_.plan, point, couplings_)
                                       : Choice{method_.family, method_.tableau, ""};
  method_.tableau = choice.tableau;
  use(*choice.family, point, choice.why);
}

void MethodSelector::use(const MethodFamily& family, const Point& point, const std::string& why) {
  family_ = &family;
  state_.history->use(make_stepper(family, state_.problem, method_, state_.plan, state_.stats(), couplings_));
  Stepper& stepper = state_.stepper();
  stepper.start(point, state_.end);
  name_ += (name_.empty() ? "" : ", then ") + stepper.name();
  state_.solution->set_method(name_, 0);
  if (!why.empty()) state_.solution->add_method({point.t, stepper.name(), why});
  state_.reached = point.t;
}

void MethodSelector::renew() {
  state_.history->use(
      make_stepper(*family_, state_.problem, method_, state_.plan, state_.stats(), couplings_));
}

/// Goes on with another method from here.
void MethodSelector::change(const MethodFamily& family, double dt, const std::string& why) {
  const Point here = state_.stepper().here();
  const double first = state_.plan.dt_first;
  state_.plan.dt_first = dt;
  use(family, here, why);
  state_.plan.dt_first = first;
}

void MethodSelector::step() {
  try {
    return state_.stepper().step(state_.end);
  } catch (const Failure& failure) {
    if (!is_automatic() || !state_.stepper().is_explicit()) throw;
    const std::string reason = failure.what(), name = name_;
    const std::size_t uses = state_.solution->methods_in_use().size();
    try {
      change(family::radau, 0, "the explicit method could not go on");
      state_.stepper().step(state_.end);
    } catch (const Failure&) {
      state_.solution->keep_methods(uses);
      name_ = name;
      state_.solution->set_method(name_, 0);
      throw Failure(reason);
    }
  }
}

void MethodSelector::change_if_stiff() {
  const Problem& problem = *state_.problem;
  if (!is_automatic() || problem.has_dense_jacobian() || !state_.stepper().is_stiff()) return;
  const double next = state_.stepper().next_dt();
  const double worth = 100 * implicit_cost(problem.n() + problem.m());  // steps
  if (state_.plan.to - state_.stepper().here().t < worth * next) return;
  change(implicit_family(problem, method_, state_.plan), next,
         "stiff: stability, not accuracy, limited the steps");
}

}  // namespace pendula::integrate
