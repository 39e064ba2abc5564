#include "dae/start/start_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduce.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {

using Index = Eigen::Index;

/// What a request says about the point.
static std::unordered_map<Expr, double> values_near(const StartRequest& r) {
  std::unordered_map<Expr, double> near{{time_symbol(), r.t}};
  for (const auto& [parameter, value] : r.parameters) near[parameter] = pendula::evaluate({&value, 1}, {})[0];
  for (const auto& list : {r.guess, r.fix})
    for (const auto& [leaf, value] : list) near[leaf] = value;
  return near;
}

/// Guesses for what was eliminated, x = a y + b with one unknown y, are guesses for y.
static StartRequest with_own_guesses(const Model& m, StartRequest r) {
  std::unordered_map<Expr, double> values{{time_symbol(), r.t}};
  for (Expr p : m.parameters)
    if (const auto own = m.values.find(p); own != m.values.end() && own->second.is_constant())
      values[p] = constant_value(own->second);
  for (const auto& [p, value] : r.parameters) values[p] = pendula::evaluate({&value, 1}, {})[0];
  for (auto& [leaf, value] : r.guess) {
    const Expr meaning = resolve(m, leaf);
    if (meaning.is_symbol() || meaning.is_constant()) continue;
    std::vector<Expr> open;
    for (Expr inside : leaves({&meaning, 1}))
      if (!values.count(inside)) open.push_back(inside);
    if (open.size() != 1 || symbol_of(open[0]).kind != Kind::variable) continue;
    double at[3];
    for (int y : {0, 1, 2}) {
      auto there = values;
      there[open[0]] = y;
      at[y] = pendula::evaluate({&meaning, 1}, there)[0];
    }
    const double slope = at[1] - at[0];
    if (slope == 0 || std::fabs(at[2] - at[1] - slope) > 1e-9 * std::fabs(slope)) continue;
    value = (value - at[0]) / slope;
    leaf = open[0];
  }
  return r;
}

StartSystem::StartSystem(const ModelPtr& m, const StartRequest& r)
    : low(index_one_form(m, values_near(r))), model(*m), request(with_own_guesses(*m, r)), inputs_(r.inputs) {
  for (const auto& list : {low->states(), low->top_derivatives(), low->algebraic()})
    unknowns.insert(unknowns.end(), list.begin(), list.end());
  for (std::size_t j = 0; j < unknowns.size(); ++j) column_[unknowns[j]] = static_cast<Index>(j);
  state_count = low->states().size();
  bind();
  if (request.keep_invariants)
    for (const Constraint& c : low->invariants) {
      add(c.residual);
      labels_.push_back(c.label);
    }
  for (std::size_t i = 0; i < low->residuals.size(); ++i) {
    const auto [block, row] = low->origin[i];
    const Block& b = low->blocks[block];  // 0 = C reads better than 0 = -C
    add(b.lhs[row].is_zero() ? b.rhs[row] : low->residuals[i]);
    labels_.push_back("equation " + low->label(i));
  }
  first_fix = rows.size();
  for (const auto& [leaf, value] : request.fix) add(resolve(model, leaf) - Expr(value));
  const std::span<const Expr> all(rows);  // only the fixes differ from start to start
  jacobian_ = sparse_jacobian(all.first(first_fix), unknowns);
  for (Entry e : sparse_jacobian(all.subspan(first_fix), unknowns)) {
    e.row += static_cast<int>(first_fix);
    jacobian_.push_back(e);
  }
  check_known();
  compile();
  LeafValues anchors;
  for (const auto& list : {request.fix, request.guess})
    for (const auto& [leaf, value] : list) anchors.push_back({resolve(model, leaf), value});
  Magnitudes m_units = magnitudes(rows, first_fix, unknowns, known, anchors);
  unit = std::move(m_units.unknowns);
  row_unit = std::move(m_units.rows);
}

std::optional<Index> StartSystem::position(Expr leaf) const {
  const auto it = column_.find(leaf);
  return it == column_.end() ? std::nullopt : std::optional(it->second);
}

std::optional<Index> StartSystem::fixed_unknown(std::size_t k) const {
  return position(resolve(model, request.fix[k].first));
}

std::vector<char> StartSystem::guessed() const {
  std::vector<char> covered(unknowns.size(), 0);
  for (const auto& [leaf, value] : request.guess)
    if (const auto j = position(resolve(model, leaf))) covered[*j] = 1;
  return covered;
}

std::vector<char> StartSystem::fixed() const {
  std::vector<char> list(unknowns.size(), 0);
  for (std::size_t k = 0; k < fixes(); ++k)
    if (const auto j = fixed_unknown(k)) list[*j] = 1;
  return list;
}

Vec StartSystem::residual(const Vec& w) const {
  const auto values = (*rows_)(leaf_values(w));
  return Eigen::Map<const Vec>(values.data(), static_cast<Index>(values.size())).cwiseQuotient(row_unit);
}

Eigen::SparseMatrix<double> StartSystem::jacobian(const Vec& w) const {
  const auto values = (*slopes_)(leaf_values(w));
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [i, j] = std::pair(jacobian_[k].row, jacobian_[k].column);
    entries.emplace_back(i, j, values[k] * (unit[j] / row_unit[i]));
  }
  Eigen::SparseMatrix<double> J(static_cast<Index>(rows.size()), w.size());
  J.setFromTriplets(entries.begin(), entries.end());
  return J;
}

void StartSystem::compile() {
  std::vector<Expr> leaves = unknowns, slopes;
  for (const auto& [leaf, value] : known) {
    leaves.push_back(leaf);
    given_.push_back(value);
  }
  for (const auto& entry : jacobian_) slopes.push_back(entry.value);
  rows_.emplace(rows, leaves);
  slopes_.emplace(slopes, leaves);
}

std::vector<double> StartSystem::leaf_values(const Vec& w) const {
  std::vector<double> values(w.begin(), w.end());
  values.insert(values.end(), given_.begin(), given_.end());
  return values;
}

std::unordered_map<Expr, double> StartSystem::point(const Vec& w) const {
  auto p = known;
  for (std::size_t j = 0; j < unknowns.size(); ++j) p[unknowns[j]] = w[static_cast<Index>(j)];
  return p;
}

/// Derivatives of inputs that are known as expressions, where reduction needs them.
void StartSystem::differentiate_inputs(Expr e) {
  for (Expr leaf : leaves({&e, 1})) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind != Kind::input || inputs_.count(leaf) || !inputs_.count(s.base)) continue;
    const auto& numeric = request.numeric_inputs;
    if (std::find(numeric.begin(), numeric.end(), s.base) != numeric.end()) continue;
    inputs_[leaf] = total_derivative(inputs_.at(s.base), s.order);
  }
}

std::string StartSystem::label(std::size_t row) const {
  if (row < first_fix) return labels_[row];
  const auto& [leaf, value] = request.fix[row - first_fix];
  return text(to_text(leaf), " = ", rounded(value));
}

void StartSystem::add(Expr e) {
  differentiate_inputs(e);
  rows.push_back(substitute(e, inputs_));
}

void StartSystem::bind() {
  known[time_symbol()] = request.t;
  std::vector<Expr> parameters = low->parameters;
  for (const auto& [leaf, e] : inputs_)  // an input's expression has parameters of its own
    for (Expr p : leaves({&e, 1}))
      if (symbol_of(p).kind == Kind::parameter) parameters.push_back(p);
  for (Expr p : parameters) {
    const auto given = request.parameters.find(p), own = model.values.find(p);
    if (given != request.parameters.end())
      known[p] = pendula::evaluate({&given->second, 1}, {})[0];
    else if (own != model.values.end())
      known[p] = pendula::evaluate({&own->second, 1}, {})[0];
    else if (symbol_of(p).value)
      known[p] = pendula::evaluate({&*symbol_of(p).value, 1}, {})[0];
    else
      throw Error(text("parameter '", symbol_of(p).name, "' has no value; give one: sys:with{ ",
                       symbol_of(p).name, " = … } or params = { ", symbol_of(p).name, " = … }"));
  }
}

std::string StartSystem::missing_input(Expr leaf) const {
  const Symbol& s = symbol_of(leaf);
  const std::string name = to_text(s.base);
  if (!s.order || !inputs_.count(s.base))
    return text("input '", to_text(leaf), "' has no value; give inputs = { ", s.name,
                " = function(t) … end }",
                s.order ? " as an expression in t, so that it can be differentiated" : "");
  const std::string key = s.order == 1   ? name + ".dot"
                          : s.order == 2 ? name + ".ddot"
                                         : text("der(", name, ", ", s.order, ")");
  return text(
      "input '", to_text(leaf), "' has no value: the function given for ", name,
      " could not be followed symbolically, so its derivative is not known. Give it by name, inputs = { [",
      name, "] = …, [", key, "] = value or function }, or give ", name, " as an expression in t");
}

void StartSystem::check_known() const {
  for (Expr leaf : leaves(rows)) {
    const Symbol& s = symbol_of(leaf);
    if (known.count(leaf) || column_.count(leaf) || s.kind == Kind::constant) continue;
    if (s.kind == Kind::input) throw Error(missing_input(leaf));
    std::vector<std::string> names;
    for (Expr e : unknowns) names.push_back(symbol_of(e).name);
    throw Error(text("'", to_text(leaf), "' is not an unknown of this model.", did_you_mean(s.name, names)));
  }
}

}  // namespace pendula::dae
