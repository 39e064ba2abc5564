#include "dae/model/model.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank/rank.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

bool is_unknown(Expr leaf) { return symbol_of(leaf).kind == pendula::Kind::variable; }

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
      if (r.is_zero() && !one) continue;  // of a column: E and A may have zero rows; structure() names them
      throw Error(text("equation ", b + 1, one ? "" : text(", row ", row + 1),
                       " contains no symbol: it reads 0 = ", to_text(r),
                       r.is_zero() ? "" : ", which never holds"));
    }
  }
}

/// Two symbols of one name make a model unreadable, and tables keyed by names ambiguous.
void check_names(std::span<const Expr> all) {
  std::unordered_map<std::string, Expr> seen;
  for (Expr leaf : all) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == pendula::Kind::constant) continue;
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
  std::vector<Expr> everything = m.residuals;  // the length of the pendulum is a parameter of C = 0 only
  for (const Constraint& c : options.invariants) everything.push_back(c.residual);
  const std::vector<Expr> all = leaves(everything);
  check_names(all);
  for (Expr x : options.x) add_variable(symbol_of(x).base, 0);
  for (Expr z : options.z) add_variable(symbol_of(z).base, 0);
  for (Expr u : options.u) inputs.insert(symbol_of(u).base);
  const bool declared = !options.x.empty() || !options.z.empty();
  for (Expr leaf : all) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == pendula::Kind::parameter) parameters.push_back(leaf);
    if (s.kind == pendula::Kind::input || (s.kind == pendula::Kind::variable && inputs.count(s.base)))
      inputs.insert(s.base);
    else if (s.kind == pendula::Kind::variable) {
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
  std::vector<Expr> meanings;  // a multiplier may be the only thing that depends on the mass
  for (const auto& [leaf, meaning] : options.relations) meanings.push_back(meaning);
  for (Expr leaf : leaves(meanings))
    if (symbol_of(leaf).kind == pendula::Kind::parameter) parameters.push_back(leaf);
  for (Expr base : bases) m.variables.push_back({base, order.at(base)});
  m.inputs.assign(inputs.begin(), inputs.end());
  sort_by_latest_declaration(m.inputs);
  sort_by_latest_declaration(parameters);
  parameters.erase(std::unique(parameters.begin(), parameters.end()), parameters.end());
  m.parameters = std::move(parameters);
}

void capture_values(Model& m, const ModelOptions& options) {
  for (Expr p : m.parameters) {
    if (const auto given = options.values.find(p); given != options.values.end())
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

/// Of every expression below some others: which leaf of a set it contains. One pass, although the rows of an
/// explicit model may share all they consist of.
class Occurrence {
 public:
  Occurrence(std::span<const Expr> outputs, const std::unordered_set<Expr>& set) {
    for (Expr node : topological(outputs)) {
      std::uint32_t& here = which_[node];
      if (node.is_symbol() || node.op() == Op::call) here = set.count(node) ? node.id() + 1 : none;
      if (node.is_symbol() || node.is_constant()) continue;
      for (Expr x : node.operands()) {
        const std::uint32_t there = which_[x];
        std::uint32_t& now = which_[node];
        now = now == none || now == there ? there : there == none ? now : several;
      }
    }
  }
  bool any(Expr e) { return which_[e] != none; }
  std::optional<Expr> only(Expr e) {
    const std::uint32_t w = which_[e];
    return w == none || w == several ? std::nullopt : std::optional(Expr::at(w - 1));
  }

  /// e = slope · leaf + rest, where that can be read off sums and products; leaf is the only one of the set.
  struct Line {
    Expr slope, rest;
  };
  std::optional<Line> line(Expr e) {
    if (!any(e)) return Line{Expr(0), e};
    if (e.is_symbol()) return Line{Expr(1), Expr(0)};
    if (e.op() != Op::add && e.op() != Op::sub && e.op() != Op::neg && e.op() != Op::mul && e.op() != Op::div)
      return std::nullopt;
    const auto a = line(e.operand(0));
    if (!a) return std::nullopt;
    if (e.op() == Op::neg) return Line{-a->slope, -a->rest};
    const Expr left = e.operand(0), right = e.operand(1);
    if (e.op() == Op::div)
      return any(right) ? std::nullopt : std::optional(Line{a->slope / right, a->rest / right});
    if (e.op() == Op::mul && !any(right)) return Line{a->slope * right, a->rest * right};
    const auto b = line(right);
    if (!b || (e.op() == Op::mul && any(left))) return std::nullopt;
    if (e.op() == Op::mul) return Line{left * b->slope, left * b->rest};
    return e.op() == Op::add ? Line{a->slope + b->slope, a->rest + b->rest}
                             : Line{a->slope - b->slope, a->rest - b->rest};
  }

 private:
  static constexpr std::uint32_t none = 0, several = 0xffffffff;
  NodeMap<std::uint32_t> which_;
};

/// Rows with derivatives, rows without; whether ∂(rows with)/∂x′ is generically nonsingular.
Kind classify(const Model& m, bool& mass_matrix) {
  if (is_explicit_ode(m)) return Kind::ode;
  const std::vector<Expr> top = m.top_derivatives();
  const std::unordered_set<Expr> top_set(top.begin(), top.end());
  std::vector<Expr> with;
  Occurrence tops(m.residuals, top_set);
  for (Expr r : m.residuals)
    if (tops.any(r)) with.push_back(r);
  const bool pure = m.algebraic().empty();
  const bool square = m.residuals.size() == m.variables.size();
  if (square && with.size() == top.size()) {
    if (solved_rows(m).size() == top.size()) return pure ? Kind::ode : Kind::semi_explicit;
    const std::vector<Entry> J = sparse_jacobian(with, top);
    const auto size = static_cast<int>(top.size());
    const auto z = m.algebraic();
    const std::unordered_set<Expr> z_set(z.begin(), z.end());
    const auto free_of = [&](const std::unordered_set<Expr>& set) {
      return std::none_of(J.begin(), J.end(), [&](const Entry& e) { return contains_any(e.value, set); });
    };
    const bool regular = generic_rank(J, size, size).rank == size;
    if (pure && regular) return Kind::implicit_ode;
    if (regular && free_of(top_set) && free_of(z_set)) {
      mass_matrix = true;
      return Kind::semi_explicit;
    }
  }
  return Kind::fully_implicit;
}

}  // namespace

bool is_explicit_ode(const Model& m) {
  std::unordered_set<Expr> top;
  for (const Variable& v : m.variables) {
    if (v.order == 0) return false;
    top.insert(derivative_leaf(v.leaf, v.order));
  }
  std::unordered_set<Expr> left;
  std::vector<Expr> right;
  for (const Block& b : m.blocks)
    for (Eigen::Index row = 0; row < b.lhs.size(); ++row) {
      if (!top.count(b.lhs[row]) || !left.insert(b.lhs[row]).second) return false;
      right.push_back(b.rhs[row]);
    }
  if (left.size() != top.size()) return false;
  const auto inside = leaves(right);
  return std::none_of(inside.begin(), inside.end(), [&](Expr leaf) { return top.count(leaf) > 0; });
}

const char* kind_name(Kind kind) {
  switch (kind) {
    case Kind::ode:
      return "ODE";
    case Kind::implicit_ode:
      return "implicit ODE";
    case Kind::semi_explicit:
      return "semi-explicit";
    case Kind::fully_implicit:
      return "fully implicit";
  }
  return "";
}

MatX dense(const std::vector<Entry>& entries, Eigen::Index rows, Eigen::Index columns) {
  MatX m = MatX::Zero(rows, columns);
  for (const Entry& e : entries) m(e.row, e.column) = e.value;
  return m;
}

std::vector<Expr> Model::states() const {
  std::vector<Expr> x;
  int highest = 0;
  for (const Variable& v : variables) highest = std::max(highest, v.order);
  for (int k = 0; k < highest; ++k)
    for (const Variable& v : variables)
      if (k < v.order) x.push_back(derivative_leaf(v.leaf, k));
  return x;
}

std::vector<Expr> Model::algebraic() const {
  std::vector<Expr> z;
  for (const Variable& v : variables)
    if (v.order == 0) z.push_back(v.leaf);
  return z;
}

std::vector<Expr> Model::top_derivatives() const {
  std::vector<Expr> top;
  for (const Variable& v : variables)
    if (v.order > 0) top.push_back(derivative_leaf(v.leaf, v.order));
  return top;
}

std::string row_letter(int row, Eigen::Index rows) {
  constexpr Eigen::Index letters = 26;
  return rows <= letters ? std::string(1, static_cast<char>('a' + row)) : text(".", row + 1);
}

std::string row_label(const Block& b, int block, int row) {
  const auto r = static_cast<std::size_t>(row);
  const bool rewritten = r < b.rewritten.size() && !b.rewritten[r].empty();
  return text("(", block + 1, b.lhs.size() == 1 ? "" : row_letter(row, b.lhs.size()), rewritten ? "*" : "",
              ")");
}

std::string Model::label(std::size_t residual) const {
  const auto [block, row] = origin[residual];
  return row_label(blocks[block], block, row);
}

std::string Model::equation_text(std::size_t residual) const {
  const auto [block, row] = origin[residual];
  return to_text(blocks[block].lhs[row]) + " = " + to_text(blocks[block].rhs[row]);
}

ModelPtr make_model(std::vector<Block> blocks, ModelOptions options) {
  if (blocks.empty()) throw Error("a model needs at least one equation, for example dae{ der(x) ~ -x }");
  auto m = std::make_shared<Model>();
  m->name = options.name;
  m->blocks = std::move(blocks);
  m->form = options.form;
  m->parent = options.parent;
  flatten(*m);
  collect_symbols(*m, options);
  if (m->variables.empty())
    throw Error("the equations contain no unknown; declare unknowns with var or vars: x = var \"x\"");
  capture_values(*m, options);
  m->kind = classify(*m, m->mass_matrix);
  m->trace = std::move(options.trace);
  m->relations = std::move(options.relations);
  m->invariants = std::move(options.invariants);
  m->drift = options.drift;
  m->projections = std::move(options.projections);
  m->mechanics = std::move(options.mechanics);
  m->domain = std::move(options.domain);
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

std::vector<Solved> solved_rows(const Model& m) {
  if (is_explicit_ode(m)) {
    std::vector<Solved> rows;
    for (std::size_t i = 0; i < m.residuals.size(); ++i) {
      const auto [block, row] = m.origin[i];
      rows.push_back({i, m.blocks[block].lhs[row], m.blocks[block].rhs[row]});
    }
    return rows;
  }
  std::unordered_set<Expr> top_set, taken, unknown;
  for (Expr leaf : m.top_derivatives()) top_set.insert(leaf);
  std::vector<Solved> rows;
  Occurrence tops(m.residuals, top_set);
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    const Expr r = m.residuals[i];
    const auto top = tops.only(r);
    if (!top || taken.count(*top)) continue;
    auto line = tops.line(r);
    if (!line) line = {partial(r, *top), Expr(0)};
    bool constant = !line->slope.is_zero();
    for (Expr leaf : leaves({&line->slope, 1})) constant = constant && !is_unknown(leaf);
    if (!constant) continue;
    taken.insert(*top);
    if (!tops.line(r)) line->rest = substitute(r, {{*top, Expr(0)}});
    rows.push_back({i, *top, -line->rest / line->slope, line->slope});
  }
  return rows;
}

/// x′ = f, 0 = g, when every derivative has its own solved row.
static void fill_explicit_form(const Model& m, FirstOrder& fo) {
  std::unordered_map<Expr, Expr> f;
  std::unordered_set<std::size_t> used;
  for (const Solved& row : solved_rows(m)) f[row.derivative] = row.f, used.insert(row.residual);
  if (f.size() != m.top_derivatives().size()) return;
  const auto list = m.top_derivatives();
  std::vector<Expr> all = m.residuals;
  for (const auto& [derivative, right] : f) all.push_back(right);
  Occurrence tops(all, std::unordered_set<Expr>(list.begin(), list.end()));
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    if (used.count(i)) continue;
    if (tops.any(m.residuals[i])) return;
    fo.g.push_back(m.residuals[i]);
  }
  for (const auto& [derivative, right] : f)
    if (tops.any(right)) return;
  for (std::size_t i = 0; i < fo.x.size(); ++i) {
    const auto it = f.find(fo.xdot[i]);
    fo.f.push_back(it == f.end() ? derivative_leaf(fo.x[i]) : it->second);
  }
  fo.semi_explicit = true;
}

FirstOrder first_order(const Model& m) {
  if (m.residuals.size() != m.variables.size())
    throw Error(text("the model has ", m.residuals.size(), " equations for ", m.variables.size(),
                     " unknowns; it cannot be solved as it stands"));
  FirstOrder fo;
  fo.x = m.states();
  fo.z = m.algebraic();
  fo.p = m.parameters;
  const std::unordered_set<Expr> state_set(fo.x.begin(), fo.x.end());
  for (Expr x : fo.x) {
    const Expr next = derivative_leaf(x);
    if (!state_set.count(next)) {
      fo.xdot.push_back(next);
      continue;
    }
    const Symbol& s = symbol_of(x);
    fo.xdot.push_back(symbol(pendula::Kind::slot, text("K_", s.name, "_", s.order)));
    fo.F.push_back(fo.xdot.back() - next);
    fo.label.push_back(to_text(next) + " is the derivative of " + to_text(x));
    fo.sides.emplace_back();
  }
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    const auto [block, row] = m.origin[i];
    fo.F.push_back(m.residuals[i]);
    fo.label.push_back("equation " + m.label(i));
    fo.sides.emplace_back(std::in_place, m.blocks[block].lhs[row], m.blocks[block].rhs[row]);
  }
  for (Expr leaf : leaves(m.residuals))
    if (std::find(m.inputs.begin(), m.inputs.end(), symbol_of(leaf).base) != m.inputs.end())
      fo.u.push_back(leaf);
  fill_explicit_form(m, fo);
  return fo;
}

}  // namespace pendula::dae
