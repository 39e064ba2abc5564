#include "integrate/simulation/regrown_states.hpp"

#include <algorithm>

#include "dae/model/lineage.hpp"
#include "integrate/simulation/run_parts.hpp"
#include "integrate/solution/regrowth.hpp"

namespace pendula::integrate {

std::vector<char> repeatable_states(const Simulation& simulation, const dae::Model& model,
                                    const Problem& problem) {
  const ToleranceRequest& atol = simulation.atol;
  const bool calls = std::any_of(simulation.events.begin(), simulation.events.end(),
                                 [](const ModelEvent& event) { return event.call != nullptr; });
  if (calls || simulation.plan.stop_when || atol.all || !atol.list.empty()) return {};
  std::vector<char> list(static_cast<std::size_t>(problem.n()), 1);
  const std::vector<Expr>& x = problem.model().x;
  const auto& followed = simulation.plan.small_states.followed;
  for (const auto& [leaf, own] : atol.some) {
    const auto at = std::find(x.begin(), x.end(), dae::resolve(model, leaf));
    if (at == x.end()) continue;
    *(list.begin() + (at - x.begin())) =
        followed &&
        std::count(followed->states.begin(), followed->states.end(), static_cast<int>(at - x.begin())) > 0;
  }
  return list;
}

Simulation following_small_states(const Simulation& simulation, const Solution& solution) {
  Simulation again = simulation;
  Regrowth regrowth = *solution.stats().regrowth;
  const Point start = start_point(solution.problem(), simulation);
  const bool begins_at_zero =
      std::any_of(regrowth.states.begin(), regrowth.states.end(), [&](int i) { return start.x[i] == 0; });
  // A state that begins at 0 has no size at first, and steps as short as such an atol: as small as needed.
  const double atol = begins_at_zero ? std::min(1e-6 * regrowth.atol, regrowth.atol * regrowth.atol) : 0;
  regrowth.atol = std::max(atol, RegrowthWatch::least_atol);
  for (const int i : regrowth.states)
    again.atol.some.emplace_back(solution.problem().model().x[i], regrowth.atol);
  regrowth.effect = Regrowth::Effect::followed;
  if (const auto& before = simulation.plan.small_states.followed) {
    regrowth.states.insert(regrowth.states.end(), before->states.begin(), before->states.end());
    std::sort(regrowth.states.begin(), regrowth.states.end());
    regrowth.states.erase(std::unique(regrowth.states.begin(), regrowth.states.end()), regrowth.states.end());
  }
  again.plan.small_states.followed = std::move(regrowth);
  return again;
}

}  // namespace pendula::integrate
