// Starts of piecewise models (ifelse, abs, min, max) whose regions differ in index: the region active at the
// start determines the hidden constraints there.
#include <bit>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/start/regimes.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t affordable = 40;  // unknowns of a model up to which the regions are solved individually
constexpr std::size_t most_choices = 8;  // 2⁸ = 256 regions, a start each
constexpr std::size_t most_reasons = 8;  // listed in an error

}  // namespace

ConsistentStatePtr start_in_region(const ModelPtr& model, const StartRequest& request) {
  if (request.nearest) {  // prefer a region that accepts the values unchanged
    StartRequest exact = request;
    exact.nearest = false;
    try {
      return start_in_region(model, exact);
    } catch (const Error&) {
    }
  }
  if (!model->form.empty() || !model->invariants.empty() || model->variables.size() > affordable)
    return nullptr;
  if (!regimes_differ(*model)) return nullptr;
  Regimes regimes(model);
  const Choices::Decided known = regimes.decided(request);
  if (regimes.choices() - static_cast<std::size_t>(std::popcount(known.choices)) > most_choices)
    return nullptr;
  std::string why;
  std::size_t reasons = 0;
  const auto refused = [&](const Regime& regime, const std::string& reason) {
    if (++reasons <= most_reasons) why += text("\n  where ", regime.region.where, ": ", reason);
  };
  for (std::uint64_t choice = 0; choice < std::uint64_t{1} << regimes.choices(); ++choice) {
    if (!known.allow(choice)) continue;
    const Regime& regime = regimes.regime(choice);
    if (!regime.model) {
      refused(regime, "the equations are singular");
      continue;
    }
    try {
      auto found = std::make_shared<ConsistentState>(*init(regime.model, request));
      if (stays_in(regime.region, *found)) {
        found->model = model;
        if (!found->piece) found->piece = regime.model;
        return found;
      }
      refused(regime, "its solution for these values lies or moves outside this region");
    } catch (const UserFacing& e) {
      refused(regime, e.what());
    }
  }
  if (reasons > most_reasons) why += text("\n  and ", reasons - most_reasons, " more");
  throw Error("no region of this piecewise model has a consistent start for these values." + why);
}

}  // namespace pendula::dae
