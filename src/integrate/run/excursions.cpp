#include "integrate/run/excursions.hpp"

#include <algorithm>

#include "base/error.hpp"

namespace pendula::integrate {

void Excursions::watch(std::vector<char> thawed) {
  thawed_ = std::move(thawed);
  any_ = std::find(thawed_.begin(), thawed_.end(), 1) != thawed_.end();
  finder_.reset();
  if (!any_) return;
  finder_.emplace(state_.problem, state_.plan.events.list);
  finder_->set_interval(state_.plan.from, state_.plan.to);
}

bool Excursions::in_last_step() {
  constexpr long few = 20;
  if (!any_ || (repeated_ > few && repeated_ > state_.stats().steps)) return false;
  EventFinder& finder = *finder_;
  for (std::size_t i = 0; i < thawed_.size(); ++i) finder.ignore(static_cast<int>(i), !thawed_[i]);
  finder.start(state_.view.to);
  const std::vector<double> there = finder.values();
  finder.start(state_.view.from);
  bool same_side = false;
  for (std::size_t i = 0; i < thawed_.size(); ++i) {
    if (!thawed_[i]) continue;
    const bool same = there[i] * finder.side(static_cast<int>(i)) > 0;
    finder.ignore(static_cast<int>(i), !same);
    same_side = same_side || same;
  }
  if (!same_side) return false;
  finder.start(state_.view.from);
  try {
    if (!finder.find(state_.stepper(), state_.view)) return false;
  } catch (const Failure&) {  // no z inside the step: it may have been anywhere
  }
  ++repeated_;
  return true;
}

}  // namespace pendula::integrate
