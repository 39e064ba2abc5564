#include "dae/regularise/regularise.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

constexpr int conversions_of_one_part = 30;

/// Converts until the structure is regular; false if that fails.
bool make_regular(Equations& e, Structure& s, Regularised& r) {
  // each pair takes one conversion
  const int most = conversions_of_one_part + static_cast<int>(e.residuals.size());
  for (int step = 0; step < most; ++step) {
    poll_interrupt();
    if (!s.matched) {
      r.log.push_back("no unknown is left for equation " + e.labels[s.offsets.unmatched[0]] +
                      ": the model is structurally singular");
      return false;
    }
    Step done = drop_cancelled(e, s, r.log);
    if (done == Step::nothing && s.regular) return true;
    if (done == Step::nothing && s.singular_on_solutions) {
      r.log.push_back(
          "the system Jacobian is regular in general, but singular wherever the equations hold: it contains "
          "the equations themselves, and the structural result is wrong");
      return false;
    }
    if (done == Step::nothing) done = eliminate_constant_rows(e, s, r.log);
    if (done == Step::nothing) done = eliminate_by_constants(e, s, r.log);
    if (done == Step::nothing) done = convert_by_shared_pair(e, s, r.log, r.definitions);
    if (done == Step::nothing) done = convert_by_combination(e, s, r.log);
    if (done == Step::nothing) done = convert_by_substitution(e, s, r.log, r.definitions);
    if (done != Step::changed) {
      if (done == Step::nothing)
        r.log.push_back(text("the system Jacobian still has rank ", s.rank.rank, " of ", e.variables.size(),
                             ", and no combination or substitution is possible"));
      return false;
    }
    const int before = s.offsets.value;
    const std::size_t unknowns = e.variables.size();
    s = structure_of(e);
    if (s.matched && !s.regular && s.offsets.value > before) {
      r.log.push_back(
          "the conversion did not lower the number of free initial values that the structure predicts: stopped");
      return false;
    }
    r.log.push_back(text("structure: rank of the system Jacobian ", s.rank.rank, " of ", e.variables.size(),
                         s.regular
                             ? text(", valid: ", s.offsets.value,
                                    s.offsets.value == 1 ? " free initial value" : " free initial values")
                             : std::string(s.matched ? ", still singular" : ""),
                         unknowns == e.variables.size() ? "" : " (with the new unknowns)"));
  }
  r.log.push_back(text("stopped after ", most, " conversions"));
  return false;
}

/// The equations in their original form; replaced rows with 0 on the left.
std::vector<Block> blocks_of(const Model& m, const Equations& e) {
  std::vector<Block> blocks = m.blocks;
  for (std::size_t i = 0; i < e.residuals.size(); ++i) {
    if (i >= m.residuals.size()) {
      Block b{VecX(1), VecX(1), e.notes[i]};
      const Expr w = e.variables[i];
      b.lhs << w;
      b.rhs << tidied(w - e.residuals[i]);
      blocks.push_back(b);
    } else if (!e.notes[i].empty() || e.residuals[i] != m.residuals[i]) {
      Block& b = blocks[m.origin[i].first];
      b.lhs[m.origin[i].second] = 0;
      b.rhs[m.origin[i].second] = e.residuals[i];
      if (e.notes[i].empty()) continue;
      b.rewritten.resize(static_cast<std::size_t>(b.lhs.size()));
      b.rewritten[m.origin[i].second] = e.notes[i];
    }
  }
  return blocks;
}

/// The largest number of differentiations of an original equation: c_i, plus one if it is needed for
/// the derivative of an original unknown with d_j = 0 (its own equation, and those of the leading
/// unknowns it contains).
int differentiations(const Equations& e, const Structure& s, std::size_t originals) {
  std::vector<std::vector<int>> columns(e.residuals.size());
  for (const Entry& entry : s.jacobian) columns[entry.row].push_back(entry.column);
  std::vector<char> more(e.residuals.size(), 0);
  std::vector<int> reached;
  const auto reach = [&](int j) {
    const int i = s.offsets.equation_of[j];
    if (!more[i]) {
      more[i] = 1;
      reached.push_back(i);
    }
  };
  for (std::size_t j = 0; j < originals; ++j)
    if (s.offsets.d[j] == 0) reach(static_cast<int>(j));
  while (!reached.empty()) {
    const auto i = static_cast<std::size_t>(reached.back());
    reached.pop_back();
    for (int j : columns[i]) reach(j);
  }
  int most = 0;
  for (std::size_t i = 0; i < e.residuals.size(); ++i)
    most = std::max(most, e.differentiated[i] + s.offsets.c[i] + more[i]);
  return most;
}

/// Substitutes the values of the parameters on which the rank of the system Jacobian depends.
bool put_in_values(const Model& m, Equations& e, const Structure& s, std::vector<std::string>& log) {
  std::vector<Expr> slopes;
  for (const Entry& entry : s.jacobian) slopes.push_back(entry.value);
  Substitution values;
  std::vector<std::string> names;
  for (Expr leaf : leaves(slopes))
    if (const auto it = m.values.find(leaf); it != m.values.end()) {
      values[leaf] = it->second;
      names.push_back(to_text(leaf) + " = " + to_text(it->second));
    }
  if (values.empty()) return false;
  const auto residuals = substitute(e.residuals, values);
  for (std::size_t i = 0; i < residuals.size(); ++i)
    e.residuals[i] = residuals[i] == e.residuals[i] ? residuals[i] : tidied(residuals[i]);
  log.push_back("with the parameter values " + join(names, ", "));
  return true;
}

}  // namespace

std::optional<Regularised> regularise(const ModelPtr& model, std::vector<std::string>* why) {
  Regularised r;
  Equations e = equations_of(*model);
  Structure s = structure_of(e);
  if (s.regular) {  // possibly singular at the parameter values of this model only
    Equations given = e;
    std::vector<std::string> log;
    if (put_in_values(*model, given, s, log))
      if (Structure there = structure_of(given);
          !there.regular || there.offsets.c != s.offsets.c || there.offsets.d != s.offsets.d) {
        e = std::move(given);
        s = std::move(there);
        r.log = std::move(log);
      }
  }
  const bool done = make_regular(e, s, r);
  if (!done && why) *why = r.log;
  if (!done || e.residuals == model->residuals) return {};
  r.nonzero = e.nonzero;
  r.offsets = s.offsets;
  r.dof = s.offsets.value - static_cast<int>(model->invariants.size());
  r.differentiations = differentiations(e, s, model->variables.size());
  r.blocks = blocks_of(*model, e);
  ModelOptions options;
  options.name = model->name;
  options.x = e.variables;
  options.u = model->inputs;
  options.form = model->form;
  options.parent = model;
  options.trace = r.log;
  options.relations = model->relations;
  options.invariants = model->invariants;
  options.events = model->events;
  options.start_values = model->start_values;
  options.start_guesses = model->start_guesses;
  options.singularity_conditions = model->singularity_conditions;
  for (Expr factor : e.nonzero)
    options.singularity_conditions.push_back(
        {factor, "the equations that were derived there are not equivalent to the model",
         "begin a new run on the other side, from sys:init{ … }"});
  r.model = make_model(r.blocks, options);
  return r;
}

ModelPtr regular_form(const ModelPtr& model) {
  const Analysis as_written = analyse(*model);
  if (as_written.regular || !as_written.offsets.unmatched.empty()) return model;
  static PerModel<ModelPtr> known;  // every start asks
  return known.of(model, [&] {
    const auto regularised = regularise(model);
    return regularised ? regularised->model : model;
  });
}

}  // namespace pendula::dae
