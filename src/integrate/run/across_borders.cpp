#include "integrate/run/across_borders.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"

namespace pendula::integrate {

/// Builds the equations with the original branches, not frozen ones, for borders that contain x′ or z and for
/// those that are unfrozen.
void AcrossBorders::make(const std::vector<Treatment>& treatment) {
  made_for_ = treatment;
  live_ = nullptr;
  const Plan& plan = state_.plan;
  const dae::FirstOrder& model = state_.problem->model();
  std::unordered_set<Expr> solved_for(model.xdot.begin(), model.xdot.end());
  solved_for.insert(model.z.begin(), model.z.end());
  std::vector<Treatment> as_written = treatment;
  for (const Event& event : plan.events.list) {
    if (!event.surface || event.modes.empty() || event.smoothness == Smoothness::open) continue;
    const std::vector<Expr> inside = leaves({&event.when, 1});
    if (std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return solved_for.count(leaf) > 0; }))
      as_written[event.surface_number] = Treatment::unfrozen;
  }
  if (as_written == treatment) return;
  live_ = plan.treat(as_written, {}).problem;
  equations_ = std::make_unique<RhsSolver>(live_, state_.stats());
}

bool AcrossBorders::solve(Point& point, const std::vector<double>& modes,
                          const std::vector<Treatment>& treatment) {
  const auto slides = [](Treatment one) { return one == Treatment::sliding; };
  if (!state_.plan.treat || std::any_of(treatment.begin(), treatment.end(), slides)) return false;
  if (made_for_ != treatment) make(treatment);
  if (!live_) return false;
  live_->set_modes(modes);
  try {
    return equations_->settle(point);
  } catch (const Failure&) {
    return false;
  }
}

}  // namespace pendula::integrate
