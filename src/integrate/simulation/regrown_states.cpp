#include "integrate/simulation/regrown_states.hpp"

#include <algorithm>

#include "dae/model/lineage.hpp"
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
  for (const auto& [leaf, value] : atol.some)
    if (const auto at = std::find(x.begin(), x.end(), dae::resolve(model, leaf)); at != x.end())
      *(list.begin() + (at - x.begin())) = 0;
  return list;
}

Simulation following_small_states(const Simulation& simulation, const Solution& solution) {
  Simulation again = simulation;
  Regrowth regrowth = *solution.stats().regrowth;
  for (const int i : regrowth.states)
    again.atol.some.emplace_back(solution.problem().model().x[i], RegrowthWatch::least_atol);
  regrowth.effect = Regrowth::Effect::followed;
  again.plan.small_states.followed = std::move(regrowth);
  return again;
}

}  // namespace pendula::integrate
