// Starts of piecewise models (ifelse, abs, min, max) whose regions differ in index: the region that is active at the
// start decides which hidden constraints hold there.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/analysis.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/piecewise.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t affordable = 12;  // unknowns of a model whose regions are solved one by one

/// The model in one region, with all unknowns of the piecewise one.
ModelPtr region_model(const ModelPtr& model, const Region& region) {
  ModelOptions options = child_of(model);
  options.trace.push_back("in the region " + region.where);
  declare_unknowns(options, *model);
  std::vector<Block> blocks;
  std::size_t next = 0;
  for (const Block& b : model->blocks) {
    Block own{VecX::Zero(b.lhs.size()), VecX::Zero(b.lhs.size()), b.note, b.rewritten};
    for (Eigen::Index row = 0; row < b.lhs.size(); ++row) own.rhs[row] = region.model.residuals[next++];
    blocks.push_back(std::move(own));
  }
  return make_model(std::move(blocks), std::move(options));
}

std::string answer(const Model& m) {
  const Analysis a = analyse(m);
  return a.regular ? text(a.index, " ", a.dof) : "singular";
}

/// A margin at values; leaves without value (derivatives that nothing asked for) count as 0.
double at(Expr e, std::unordered_map<Expr, double> values) {
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind == Kind::variable) values.try_emplace(leaf, 0.0);
  return pendula::evaluate({&e, 1}, values)[0];
}

/// Does the start lie in the region, and on its border not move out of it?
bool stays_in(const Region& region, const ConsistentState& start) {
  constexpr double border = 1e-9;
  for (Expr margin : region.margins) {
    const double size = border * (1 + size_of_terms(margin, start.values)), here = at(margin, start.values);
    if (!(here >= -size)) return false;
    if (here > size || margin.op() == Op::ifelse) continue;
    if (!(at(total_derivative(margin), start.values) >= -border)) return false;
  }
  return true;
}

/// Regions that time and parameters exclude already.
bool excluded(const Region& region, const StartRequest& request, const Model& m) {
  for (Expr margin : region.margins) {
    std::unordered_map<Expr, double> values{{time_symbol(), request.t}};
    for (const auto& list : {m.values, request.parameters})
      for (const auto& [p, value] : list) values[p] = pendula::evaluate({&value, 1}, {})[0];
    const auto inside = leaves({&margin, 1});
    const bool known =
        std::all_of(inside.begin(), inside.end(), [&](Expr leaf) { return values.count(leaf) > 0; });
    if (known && pendula::evaluate({&margin, 1}, values)[0] < 0) return true;
  }
  return false;
}

}  // namespace

ConsistentStatePtr start_in_region(const ModelPtr& model, const StartRequest& request) {
  if (!model->form.empty() || !model->invariants.empty() || model->variables.size() > affordable)
    return nullptr;
  if (model->residuals.size() != model->variables.size()) return nullptr;
  const std::vector<Region> all = regions(*model);
  std::vector<ModelPtr> models;
  bool differ = false;
  const std::string whole = all.empty() ? "" : answer(*model);
  for (const Region& region : all) {
    models.push_back(region_model(model, region));
    differ = differ || answer(*models.back()) != whole;
  }
  if (!differ) return nullptr;
  std::string why;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (excluded(all[k], request, *model)) continue;
    try {
      auto found = std::make_shared<ConsistentState>(*init(models[k], request));
      if (stays_in(all[k], *found)) {
        found->model = model;
        return found;
      }
      why += text("\n  where ", all[k].where,
                  ": its solution for these values lies or moves outside this region");
    } catch (const UserFacing& e) {
      why += text("\n  where ", all[k].where, ": ", e.what());
    }
  }
  throw Error("no region of this piecewise model has a consistent start for these values." + why);
}

}  // namespace pendula::dae
