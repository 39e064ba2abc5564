#include "dae/model/make_model.hpp"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/occurrence.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/rank/rank.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

void check_block(const Block& block, std::size_t number) {
  if (block.lhs.size() != block.rhs.size())
    throw Error(text("equation ", number, ": the left side has ", block.lhs.size(), " rows, the right side ",
                     block.rhs.size()));
  if (block.lhs.size() == 0) throw Error(text("equation ", number, " is empty"));
}

/// Collects residuals with their origin.
void flatten(Model& m) {
  for (std::size_t b = 0; b < m.blocks.size(); ++b) {
    check_block(m.blocks[b], b + 1);
    for (Eigen::Index row = 0; row < m.blocks[b].lhs.size(); ++row) {
      m.residuals.push_back(m.blocks[b].lhs[row] - m.blocks[b].rhs[row]);
      m.origin.push_back({static_cast<int>(b), static_cast<int>(row)});
      const Expr r = m.residuals.back();
      if (!r.is_constant()) continue;
      const bool one = m.blocks[b].lhs.size() == 1;
      // of a column: E and A may have zero rows, which structure() reports
      if (r.is_zero() && !one) continue;
      throw Error(text("equation ", b + 1, one ? "" : text(", row ", row + 1),
                       " contains no symbol: it reads 0 = ", to_text(r),
                       r.is_zero() ? "" : ", which never holds"));
    }
  }
}

/// Rejects two symbols of one name: the model would be unreadable, and tables keyed by names ambiguous.
void check_names(std::span<const Expr> all) {
  std::unordered_map<std::string, Expr> seen;
  for (Expr leaf : all) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::constant) continue;
    const auto [it, made] = seen.try_emplace(s.name, s.base);
    if (!made && it->second != s.base)
      throw Error(text("two different symbols are called '", s.name,
                       "' in this model; one is a variable, parameter or input of another kind: rename one"));
  }
}

void collect_symbols(Model& m, const ModelOptions& options) {
  std::unordered_map<Expr, int> order;
  std::vector<Expr> bases;
  const auto add_variable = [&](Expr base, int k) {
    const auto [it, made] = order.try_emplace(base, k);
    if (made) bases.push_back(base);
    it->second = std::max(it->second, k);
  };
  std::unordered_set<Expr> inputs;
  std::vector<Expr> parameters;
  // the length of a pendulum, for example, is a parameter of C = 0 only
  std::vector<Expr> everything = m.residuals;
  for (const Constraint& c : m.invariants) everything.push_back(c.residual);
  const std::vector<Expr> all = leaves(everything);
  check_names(all);
  for (Expr x : options.x) add_variable(symbol_of(x).base, 0);
  for (Expr z : options.z) add_variable(symbol_of(z).base, 0);
  for (Expr u : options.u) inputs.insert(symbol_of(u).base);
  const bool declared = !options.x.empty() || !options.z.empty();
  for (Expr leaf : all) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::parameter) parameters.push_back(leaf);
    if (s.kind == Kind::input || (s.kind == Kind::variable && inputs.count(s.base)))
      inputs.insert(s.base);
    else if (s.kind == Kind::variable) {
      if (declared && !order.count(s.base))
        throw Error(text("the equations contain '", s.name,
                         "', which is not among the declared unknowns; add it to x or z"));
      add_variable(s.base, s.order);
    }
  }
  for (Expr z : options.z)
    if (order.at(symbol_of(z).base) > 0)
      throw Error(text("'", symbol_of(z).name,
                       "' was declared algebraic (z), but its derivative occurs; move it to x"));
  if (!declared) sort_by_latest_declaration(bases);
  std::vector<Expr> meanings;  // a multiplier may be the only quantity that depends on the mass
  for (const auto& [leaf, meaning] : m.relations) meanings.push_back(meaning);
  for (const Transition& event : m.events) {
    meanings.push_back(event.when);
    for (const auto& [state, value] : event.reset) meanings.push_back(value);
  }
  for (const auto* starts : {&m.start_values, &m.start_guesses})
    for (const auto& [leaf, value] : *starts) meanings.push_back(value);
  for (Expr leaf : leaves(meanings)) {
    if (symbol_of(leaf).kind == Kind::parameter) parameters.push_back(leaf);
    if (symbol_of(leaf).kind == Kind::input && m.relations.count(leaf) == 0)
      inputs.insert(symbol_of(leaf).base);  // eliminated unknowns still depend on it
  }
  for (Expr base : bases) m.variables.push_back({base, order.at(base)});
  m.inputs.assign(inputs.begin(), inputs.end());
  sort_by_latest_declaration(m.inputs);
  sort_by_latest_declaration(parameters);
  parameters.erase(std::unique(parameters.begin(), parameters.end()), parameters.end());
  m.parameters = std::move(parameters);
}

void capture_values(Model& m, const ParameterValues& values) {
  for (Expr p : m.parameters) {
    if (const auto given = values.find(p); given != values.end())
      m.values[p] = given->second;
    else if (const auto inherited = m.parent ? m.parent->values.find(p) : m.values.end();
             m.parent && inherited != m.parent->values.end())
      m.values[p] = inherited->second;
    else if (symbol_of(p).value)
      m.values[p] = *symbol_of(p).value;
  }
}

bool contains_any(Expr e, const std::unordered_set<Expr>& set) {
  for (Expr leaf : leaves({&e, 1}))
    if (set.count(leaf)) return true;
  return false;
}

/// Classifies by the rows with and without derivatives, and by whether ∂(rows with)/∂x′
/// is generically nonsingular.
ModelKind classify(const Model& m, bool& mass_matrix) {
  if (is_explicit_ode(m)) return ModelKind::ode;
  const std::vector<Expr> top = m.top_derivatives();
  const std::unordered_set<Expr> top_set(top.begin(), top.end());
  std::vector<Expr> with;
  Occurrence tops(m.residuals, top_set);
  for (Expr r : m.residuals)
    if (tops.any(r)) with.push_back(r);
  const bool pure = m.algebraic().empty();
  const bool square = m.residuals.size() == m.variables.size();
  if (square && with.size() == top.size()) {
    if (solved_rows(m).size() == top.size()) return pure ? ModelKind::ode : ModelKind::semi_explicit;
    const std::vector<Entry> J = sparse_jacobian(with, top);
    const auto size = static_cast<int>(top.size());
    const auto z = m.algebraic();
    const std::unordered_set<Expr> z_set(z.begin(), z.end());
    const auto free_of = [&](const std::unordered_set<Expr>& set) {
      return std::none_of(J.begin(), J.end(), [&](const Entry& e) { return contains_any(e.value, set); });
    };
    const bool regular = generic_rank(J, size, size, with).rank == size;
    if (pure && regular) return ModelKind::implicit_ode;
    if (regular && free_of(top_set) && free_of(z_set)) {
      mass_matrix = true;
      return ModelKind::semi_explicit;
    }
  }
  return ModelKind::fully_implicit;
}

}  // namespace

ModelPtr make_model(std::vector<Block> blocks, ModelOptions options) {
  if (blocks.empty()) throw Error("a model needs at least one equation, for example dae{ der(x) ~ -x }");
  auto m = std::make_shared<Model>();
  const ParameterValues given = std::move(options.values);
  static_cast<ModelAttributes&>(*m) = std::move(options);
  m->values.clear();
  m->blocks = std::move(blocks);
  flatten(*m);
  collect_symbols(*m, options);
  if (m->variables.empty())
    throw Error("the equations contain no unknown; declare unknowns with var or vars: x = var \"x\"");
  capture_values(*m, given);
  m->kind = classify(*m, m->mass_matrix);
  return m;
}

ModelPtr with_values(const ModelPtr& model, const ParameterValues& values) {
  auto copy = std::make_shared<Model>(*model);
  for (const auto& [p, value] : values) {
    if (std::find(copy->parameters.begin(), copy->parameters.end(), p) == copy->parameters.end()) {
      std::vector<std::string> names;
      for (Expr q : copy->parameters) names.push_back(symbol_of(q).name);
      throw Error(text("the model has no parameter '", symbol_of(p).name, "'.",
                       did_you_mean(symbol_of(p).name, names)));
    }
    copy->values[p] = value;
  }
  return copy;
}

}  // namespace pendula::dae
