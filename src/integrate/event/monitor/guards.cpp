#include "integrate/event/monitor/guards.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/singular/singularity_conditions.hpp"
#include "integrate/problem/per_equations.hpp"

namespace pendula::integrate {

using Leaves = std::unordered_set<Expr>;

static Leaves arguments_of(const Problem& problem) {
  return Leaves(problem.arguments().begin(), problem.arguments().end());
}

static bool all_known(std::span<const Expr> expressions, const Leaves& known) {
  const std::vector<Expr> inside = leaves(expressions);
  return std::all_of(inside.begin(), inside.end(),
                     [&](Expr leaf) { return known.count(leaf) || symbol_of(leaf).kind == Kind::constant; });
}

const std::vector<dae::DomainCondition>& domain_conditions_of(const Problem& problem) {
  static PerEquations<std::vector<dae::DomainCondition>> known;
  return known.of(problem, [&] { return dae::domain_conditions(problem.model().F); });
}

bool all_known(Expr e, const Problem& problem) { return all_known({&e, 1}, arguments_of(problem)); }

static std::vector<Guard> guards_of(const std::vector<dae::SingularityCondition>& conditions,
                                    const Substitution& inputs, const Problem& problem) {
  const Leaves known = arguments_of(problem);
  std::vector<Guard> guards;
  for (const dae::SingularityCondition& n : conditions) {
    const Expr factor = substitute(n.factor, inputs);
    if (factor.is_constant() || !all_known({&factor, 1}, known)) continue;
    const bool root = !factor.is_symbol() && factor.op() == Op::sqrt;
    guards.push_back({root ? factor.operand(0) : factor,
                      text(dae::truncated_text(n.factor), " = 0 there, and ", n.where,
                           n.remedy.empty() ? "" : "; ", n.remedy),
                      root});
  }
  return guards;
}

std::vector<Guard> guards_of(const dae::ModelPtr& model, const Substitution& inputs, const Problem& problem,
                             bool all) {
  return guards_of(dae::singularity_conditions(model, all), inputs, problem);
}

std::vector<Guard> choices_of(const dae::ModelPtr& model, const Substitution& inputs,
                              const Problem& problem) {
  return guards_of(dae::choice_conditions(model), inputs, problem);
}

std::vector<dae::LargeBlock> blocks_of(const dae::ModelPtr& model, const Substitution& inputs,
                                       const Problem& problem) {
  const Leaves known = arguments_of(problem);
  std::vector<dae::LargeBlock> blocks = dae::large_blocks(model);
  std::erase_if(blocks, [&](dae::LargeBlock& block) {
    for (dae::LargeBlock::Matrix* m : {&block.gradients, &block.jacobian, &block.all}) {
      std::vector<Expr> values;
      for (const Entry& e : m->entries) values.push_back(e.value);
      if (!inputs.empty()) values = substitute(values, inputs);
      if (!all_known(values, known)) return true;
      for (std::size_t k = 0; k < values.size(); ++k) m->entries[k].value = values[k];
    }
    return false;
  });
  return blocks;
}

bool varies(Expr e, const Problem& problem) {
  const std::vector<Expr>& fixed = problem.model().p;
  const std::vector<Expr> inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
    const bool constant = symbol_of(leaf).kind == Kind::constant;
    return !constant && std::find(fixed.begin(), fixed.end(), leaf) == fixed.end();
  });
}

}  // namespace pendula::integrate
