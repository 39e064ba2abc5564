#include "dae/reduce/reduce.hpp"

#include <algorithm>
#include <memory>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/classification.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/rank_reason.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/least_norm.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/differentiation.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// Reports rows such as p′ = v that were substituted into a derivative of the constraints.
void describe_substitutions(const Model& m, const std::vector<Constraint>& constraints,
                            std::vector<std::string>& lines) {
  const auto known = kinematics(m);
  std::vector<Expr> residuals;
  for (const Constraint& c : constraints) residuals.push_back(c.residual);
  const auto inside = leaves(residuals);
  const std::unordered_set<Expr> differentiated(inside.begin(), inside.end());
  std::unordered_set<int> described;
  for (const auto& solved : solved_rows(m)) {
    const int block = m.origin[solved.residual].first;
    if (!known.count(solved.derivative) || !differentiated.count(symbol_of(solved.derivative).base)) continue;
    if (!described.insert(block).second) continue;
    lines.push_back(text("substituting (", block + 1, ")  ",
                         formula(ref(m.blocks[block].lhs), " = ", ref(m.blocks[block].rhs))));
  }
}

/// "x₁′, x₂′, z"; for a large model the first names only.
std::string unknowns_text(const Model& m) {
  constexpr std::size_t most = 40, shown = 12;  // names; of a longer list
  std::vector<Expr> list = m.top_derivatives();
  const auto z = m.algebraic();
  list.insert(list.end(), z.begin(), z.end());
  if (list.size() <= most) return names_of(list);
  const std::size_t all = list.size();
  list.resize(shown);
  return text(names_of(list), ", … ", all, " in all");
}

}  // namespace

std::vector<Entry> top_jacobian(const Model& m) {
  static ModelCache<std::vector<Entry>> known(cached_models);  // every start needs it
  const ModelKey key = key_of(m);
  if (const auto* entries = known.find(key)) return *entries;
  std::vector<Expr> unknowns = m.top_derivatives();
  const auto z = m.algebraic();
  unknowns.insert(unknowns.end(), z.begin(), z.end());
  return known.insert(key, sparse_jacobian(m.residuals, unknowns));
}

namespace {

ModelPtr made_acc(const ModelPtr& given);

}  // namespace

ModelPtr reduce_acc(const ModelPtr& given) {
  static PerModel<ModelPtr> known;  // other forms and every start need this one first
  return known.of(given, [&] { return made_acc(given); });
}

namespace {

ModelPtr made_acc(const ModelPtr& given) {
  const ModelPtr model = regular_form(given);
  const Analysis a = require_regular(*model);
  if (a.index <= 1 && a.offsets.value == static_cast<int>(model->states().size())) return model;
  Differentiated d = differentiate(*model, a.offsets);
  ModelOptions options = child_of(model);
  options.form = "acc";
  options.projections.clear();
  options.drift = DriftLaw::polynomial;
  options.invariants.insert(options.invariants.end(), d.constraints.begin(), d.constraints.end());
  // an algebraic variable may have received a derivative
  for (std::size_t j = 0; j < model->variables.size(); ++j) {
    const Variable& v = model->variables[j];
    (v.order > 0 || a.offsets.d[j] > 0 ? options.x : options.z).push_back(v.leaf);
  }
  options.u = model->inputs;
  options.trace = std::move(d.trace);
  describe_substitutions(*model, d.constraints, options.trace);
  ModelPtr low = make_model(std::move(d.blocks), options);
  const auto n = static_cast<int>(low->residuals.size());
  const int rank = generic_rank(top_jacobian(*low), n, n, low->residuals).rank;
  if (rank < n)
    throw Failure(text("differentiating did not lower the index to 1: the Jacobian with respect to (",
                       unknowns_text(*low), ") has rank ", rank, " of ", n));
  auto done = std::make_shared<Model>(*low);
  done->trace.push_back(
      text("The Jacobian with respect to (", unknowns_text(*low), ") has rank ", rank, " of ", n, ": index ",
           low->algebraic().empty() && low->kind != ModelKind::fully_implicit ? 0 : 1, "."));
  const auto reason = rank_reason(*done);
  done->trace.insert(done->trace.end(), reason.begin(), reason.end());
  for (const auto& [word, line] : classification(*model))
    if (word == "holds")
      done->trace.push_back(
          (line.starts_with("index") ? "The original model has " : "Of the original model: ") + line + ".");
  constexpr std::size_t most = 40;  // conditions in a trace
  std::vector<std::string> conditions;
  for (const Constraint& c : done->invariants)
    if (conditions.size() < most) conditions.push_back(condition_text(c));
  if (done->invariants.size() > most) conditions.push_back(text("… ", done->invariants.size(), " in all"));
  done->trace.push_back("The new model no longer imposes " + join(conditions, ", ") +
                        ": the start must satisfy " + (conditions.size() == 1 ? "it." : "them."));
  return done;
}

}  // namespace

void refuse_form(const char* form, const Model& m, const char* lacking) {
  const bool regularised = std::any_of(m.blocks.begin(), m.blocks.end(), [](const Block& b) {
    return std::any_of(b.rewritten.begin(), b.rewritten.end(), [](const auto& how) { return !how.empty(); });
  });
  throw Error(text("form \"", form, "\": ", regularised ? "the regularised equations have" : "the model has",
                   " index ", require_regular(m).index, " and ", lacking, "; ",
                   regularised ? "sys:reduce() gives them" : "it can be integrated as it stands"));
}

ModelPtr index_one_form(const ModelPtr& model, const std::unordered_map<Expr, double>& near) {
  try {
    return reduce_acc(model);
  } catch (const Failure&) {
    try {
      ReduceOptions options;
      options.at = near;
      return reduce_array(model, options);
    } catch (const Failure&) {  // the first failure explains more
    }
    if (const std::string open = why_forces_are_open(*model); !open.empty()) throw Failure(open);
    throw;
  }
}

}  // namespace pendula::dae
