// Starts on the border of a sign. Dry friction on a body at rest is the force that keeps it at rest, up to
// the limit of friction.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/start/regimes.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

// Of the terms, which counts as 0. Arguments from a solved start were off by up to 2.5·10⁻¹² (a pendulum in
// 10⁶ s and nm); one that is not 0 fails the trials with 0.
constexpr double rounding = 1e-10;
constexpr int values_of_sign = 4;      // 1, -1, 0, and an unknown that keeps the argument at 0
constexpr std::size_t most_signs = 4;  // 4⁴ = 256 trials

/// The sign functions whose arguments are 0 at a start.
std::vector<Expr> signs_at_zero(const Model& model, const ConsistentState& at) {
  std::unordered_map<Expr, double> sizes = at.values;  // units measure the rounding of a speed that is 0
  for (const auto& [leaf, unit] : at.units)
    if (const auto known = sizes.find(leaf); known != sizes.end())
      known->second = std::max(std::fabs(known->second), unit);
  std::vector<Expr> nodes;
  for (Expr node : topological(model.residuals)) {
    if (node.op() != Op::sign) continue;
    const Expr argument = node.operand(0);
    if (std::fabs(at(argument)) <= rounding * (1 + size_of_terms(argument, sizes))) nodes.push_back(node);
  }
  return nodes;
}

/// A model in which each sign is 1, -1, 0 (if its argument stays 0 for any sign), or an unknown that keeps
/// the argument at 0.
struct Trial {
  ModelPtr model;
  Region region;
  std::vector<std::pair<Expr, int>> signs;  ///< of arguments, a short time after the start
};

Trial trial(const ModelPtr& model, const std::vector<Expr>& signs, int which) {
  const std::vector<Expr> unknowns = new_variables(*model, "friction", signs.size());
  ModelOptions options = child_of(model);
  declare_unknowns(options, *model);
  Region region{"", *model, {}};
  std::vector<std::pair<Expr, int>> sides;
  Substitution values;
  std::vector<Block> more;
  for (std::size_t k = 0; k < signs.size(); ++k, which /= values_of_sign) {
    const Expr argument = signs[k].operand(0);
    if (const int value = which % values_of_sign; value < 3) {
      const int side = value == 0 ? 1 : value == 1 ? -1 : 0;
      values[signs[k]] = Expr(side);
      sides.emplace_back(argument, side);
      continue;
    }
    values[signs[k]] = unknowns[k];
    options.z.push_back(unknowns[k]);
    more.push_back({VecX::Zero(1), VecX::Constant(1, argument), "", {}});
    region.margins.push_back(Expr(1) - unknowns[k]);
    region.margins.push_back(Expr(1) + unknowns[k]);
  }
  std::vector<Block> blocks = model->blocks;
  for (Block& b : blocks) {
    for (auto* side : {&b.lhs, &b.rhs})
      for (Expr& e : *side) e = substitute(e, values);
  }
  blocks.insert(blocks.end(), more.begin(), more.end());
  return {make_model(std::move(blocks), std::move(options)), std::move(region), std::move(sides)};
}

}  // namespace

ConsistentStatePtr start_on_signs(const ModelPtr& model, const StartRequest& request,
                                  const ConsistentState& plain) {
  const bool of_model = model->form.empty() || model->form == "array";  // whose rows hold for each sign
  if (!of_model || !model->invariants.empty()) return nullptr;
  const std::vector<Expr> signs = signs_at_zero(*model, plain);
  if (signs.empty() || signs.size() > most_signs) return nullptr;
  const int count =
      static_cast<int>(std::lround(std::pow(values_of_sign, static_cast<double>(signs.size()))));
  for (int which = 0; which < count; ++which) {
    try {
      const Trial tried = trial(model, signs, which);
      auto found = std::make_shared<ConsistentState>(*init(tried.model, request));
      if (!stays_in(tried.region, *found)) continue;
      if (!std::all_of(tried.signs.begin(), tried.signs.end(),
                       [&](const auto& of) { return sign_after(of.first, *found) == of.second; }))
        continue;
      found->model = model;
      if (!found->piece) found->piece = tried.model;
      std::erase_if(found->rows, [&](const LedgerRow& row) {
        return std::none_of(plain.rows.begin(), plain.rows.end(),
                            [&](const LedgerRow& own) { return own.leaf == row.leaf; });
      });
      return found;
    } catch (const UserFacing&) {  // no start with these signs; others are tried
    }
  }
  return nullptr;
}

}  // namespace pendula::dae
