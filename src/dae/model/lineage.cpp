#include "dae/model/lineage.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/model_key.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {

std::unordered_set<std::string> used_names(const Model& m) {
  std::unordered_set<std::string> names;
  std::vector<Expr> all = m.residuals;
  for (const Constraint& c : m.invariants) all.push_back(c.residual);
  for (Expr leaf : leaves(all)) {
    names.insert(symbol_of(leaf).name);
    names.insert(symbol_of(leaf).vector);
  }
  return names;
}

std::string fresh_name(const std::unordered_set<std::string>& used, const std::string& preferred,
                       const std::string& fallback) {
  if (!used.count(preferred)) return preferred;
  std::string name = fallback;
  while (used.count(name)) name += "_";
  return name;
}

std::vector<Group> groups(const Model& m) {
  std::vector<Group> out;
  for (const Variable& v : m.variables) {
    const Symbol& s = symbol_of(v.leaf);
    const bool same =
        !s.vector.empty() && !out.empty() && out.back().name == s.vector && out.back().order == v.order;
    if (!same) out.push_back({s.vector.empty() ? s.name : s.vector, {}, v.order});
    out.back().leaves.push_back(v.leaf);
  }
  return out;
}

std::vector<Expr> new_variable_like(const Group& g, const std::string& name) {
  if (g.leaves.size() == 1) return newly_declared({symbol(Kind::variable, name)});
  return newly_declared(symbol_vector(Kind::variable, name, static_cast<int>(g.leaves.size())));
}

std::vector<Expr> new_variables(const Model& m, const std::string& name, std::size_t n) {
  const std::string fresh = fresh_name(used_names(m), name, name + "_");
  if (n == 1) return newly_declared({symbol(Kind::variable, fresh)});
  return newly_declared(symbol_vector(Kind::variable, fresh, static_cast<int>(n)));
}

VecX mapped(const VecX& v, const Substitution& s) { return column(substitute(entries(v), s)); }

ModelOptions child_of(const ModelPtr& m) {
  ModelOptions options;
  static_cast<ModelAttributes&>(options) = *m;
  options.parent = m;
  options.values.clear();  // inherited from the parent
  options.trace.clear();
  return options;
}

void move_invariants(ModelOptions& options, const Substitution& s) {
  for (Constraint& c : options.invariants) c.residual = substitute(c.residual, s);
  // together, because they share subexpressions such as the solution of one linear system
  std::vector<Expr> meanings;
  for (const auto& [leaf, meaning] : options.relations) meanings.push_back(meaning);
  meanings = substitute(meanings, s);
  for (SingularityCondition& n : options.singularity_conditions) n.factor = substitute(n.factor, s);
  std::size_t next = 0;
  for (auto& [leaf, meaning] : options.relations) meaning = meanings[next++];
  for (Projection& p : options.projections) {
    p.unknowns = substitute(p.unknowns, s);
    p.residuals = substitute(p.residuals, s);
    for (Entry& entry : p.jacobian) entry.value = substitute(entry.value, s);
    for (Entry& entry : p.weight) entry.value = substitute(entry.value, s);
  }
}

void declare_unknowns(ModelOptions& options, const Model& m) {
  for (const Variable& v : m.variables) (v.order ? options.x : options.z).push_back(v.leaf);
  options.u = m.inputs;
}

std::vector<Chain> chains(const Model& model, const Model& low) {
  std::vector<Chain> list;
  for (std::size_t k = model.invariants.size(); k < low.invariants.size(); ++k) {
    const Constraint& c = low.invariants[k];
    const auto same = [&](const Chain& chain) {
      return chain.below[0].origin == c.origin && chain.below[0].row == c.row;
    };
    auto chain = std::find_if(list.begin(), list.end(), same);
    if (chain == list.end()) {
      const auto block = static_cast<std::size_t>(c.origin.value());
      list.push_back({{}, block, c.row, low.blocks[block].rhs[c.row]});
      chain = list.end() - 1;
    }
    chain->below.push_back(c);
  }
  for (Chain& chain : list)
    std::sort(chain.below.begin(), chain.below.end(),
              [](const Constraint& a, const Constraint& b) { return a.derivative < b.derivative; });
  return list;
}

ModelPtr original(const ModelPtr& m) {
  ModelPtr source = m;
  while (!source->form.empty() && source->parent) source = source->parent;
  const auto differs = [&](Expr p) {
    const auto own = m->values.find(p), there = source->values.find(p);
    return own != m->values.end() && (there == source->values.end() || own->second != there->second);
  };
  if (source == m || std::none_of(source->parameters.begin(), source->parameters.end(), differs))
    return source;
  // one object for each m: what is remembered about a model is found by its address
  static PerModel<ModelPtr> known;
  return known.of(m, [&] {
    auto copy = std::make_shared<Model>(*source);
    for (Expr p : copy->parameters)
      if (const auto it = m->values.find(p); it != m->values.end()) copy->values[p] = it->second;
    return copy;
  });
}

/// Derivatives of eliminated unknowns for which only the unknown itself has a relation: w = phi′ with phi = a
/// - b becomes a′ - b′.
static Substitution derivatives_of_relations(const Model& model, Expr e) {
  Substitution result;
  for (Expr leaf : leaves({&e, 1})) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind != Kind::variable || model.relations.count(leaf) > 0) continue;
    for (int below = s.order - 1; below >= 0; --below) {
      const auto lower = model.relations.find(derivative_leaf(s.base, below));
      if (lower == model.relations.end()) continue;
      result[leaf] = total_derivative(lower->second, s.order - below);
      break;
    }
  }
  return result;
}

Expr resolve(const Model& model, Expr e) {
  if (model.relations.empty()) return e;
  constexpr int most = 10;  // nested definitions
  for (int pass = 0; pass < most; ++pass) {
    e = substitute(e, model.relations);
    const Substitution more = derivatives_of_relations(model, e);
    if (more.empty()) break;
    e = substitute(e, more);
  }
  // Symbols introduced by a descendant (v for q′) stand for the older expression in an ancestor. That inverse
  // relation is handled by the caller that knows both models (ConsistentState::value).
  return e;
}

std::string condition_text(const Constraint& c) {
  return c.label.starts_with("(") ? c.label : c.label + " = 0";
}

std::string names_of(const std::vector<Expr>& list) {
  std::vector<std::string> names;
  for (Expr e : list) names.push_back(to_text(e));
  return join(names, ", ");
}

std::string grouped_names(const std::vector<Expr>& list) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.size();) {
    const Symbol& s = symbol_of(list[i]);
    const std::size_t whole = vector_components(s.vector).size();
    std::size_t n = 0;
    while (!s.vector.empty() && i + n < list.size() && symbol_of(list[i + n]).vector == s.vector &&
           symbol_of(list[i + n]).order == s.order)
      ++n;
    if (n > 1 && n == whole) {
      names.push_back(vector_to_text(column(std::span(list).subspan(i, n))));
      i += n;
    } else {
      names.push_back(to_text(list[i++]));
    }
  }
  return join(names, ", ");
}

std::string column_text(const VecX& v) { return v.size() == 1 ? to_text(v[0]) : vector_to_text(v); }

}  // namespace pendula::dae
