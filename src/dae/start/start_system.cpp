#include "dae/start/start_system.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/rank/stable_values.hpp"
#include "dae/reduce/reduce.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/scaled_exponentials.hpp"

namespace pendula::dae {

using Index = Eigen::Index;

/// The values in a request near the point.
static std::unordered_map<Expr, double> values_near(const StartRequest& r) {
  std::unordered_map<Expr, double> near{{time_symbol(), r.t}};
  for (const auto& [parameter, value] : r.parameters) near[parameter] = pendula::evaluate({&value, 1}, {})[0];
  for (const auto& list : {r.guess, r.fix})
    for (const auto& [leaf, value] : list) near[leaf] = value;
  return near;
}

/// Converts guesses for eliminated unknowns x = a y + b with one unknown y to guesses for y.
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
    constexpr double curved = 1e-9;  // relative to the slope: a line has rounding errors only
    if (slope == 0 || std::fabs(at[2] - at[1] - slope) > curved * std::fabs(slope)) continue;
    value = (value - at[0]) / slope;
    leaf = open[0];
  }
  return r;
}

namespace {

std::string missing_input(Expr leaf, const Substitution& inputs) {
  const Symbol& s = symbol_of(leaf);
  const std::string name = to_text(s.base);
  if (!s.order || !inputs.count(s.base))
    return text("input '", to_text(leaf), "' has no value; give inputs = { ", s.name,
                " = function(t) … end }",
                s.order ? " as an expression in t, so that it can be differentiated" : "");
  const std::string key = s.order == 1   ? name + ".dot"
                          : s.order == 2 ? name + ".ddot"
                                         : text("der(", name, ", ", s.order, ")");
  return text(
      "input '", to_text(leaf), "' has no value: the function given for ", name,
      " could not be followed symbolically (in it sin is needed for math.sin, ifelse for if), so its derivative is not "
      "known. Give it by name, inputs = { [",
      name, "] = …, [", key, "] = value or function }, or give ", name, " as an expression in t");
}

/// Assembles StartEquations.
class Builder {
 public:
  Builder(const ModelPtr& model, const ModelPtr& low, const StartRequest& request,
          const std::unordered_map<Expr, double>& known)
      : request_(request), inputs_(request.inputs), made_(std::make_shared<StartEquations>()) {
    made_->model = model;
    made_->low = low;
    for (const auto& [leaf, value] : known) made_->given.push_back(leaf);
  }

  StartEquationsPtr operator()() {
    const Model& low = *made_->low;
    for (const auto& list : {low.states(), low.top_derivatives(), low.algebraic()})
      made_->unknowns.insert(made_->unknowns.end(), list.begin(), list.end());
    for (std::size_t j = 0; j < made_->unknowns.size(); ++j)
      made_->column[made_->unknowns[j]] = static_cast<Index>(j);
    made_->state_count = low.states().size();
    add_equations(low);
    made_->first_fix = made_->rows.size();
    add_fixes();
    check_known();
    const std::vector<Expr> nodes = topological(made_->model->residuals);
    made_->has_signs = std::any_of(nodes.begin(), nodes.end(), [](Expr e) { return e.op() == Op::sign; });
    compile();
    made_->inputs = std::move(inputs_);
    return made_;
  }

 private:
  void add_equations(const Model& low) {
    if (request_.keep_invariants)
      for (const Constraint& c : low.invariants) {
        add(c.residual);
        made_->labels.push_back(c.label);
      }
    for (std::size_t i = 0; i < low.residuals.size(); ++i) {
      const auto [block, row] = low.origin[i];
      const Block& b = low.blocks[block];  // 0 = C reads better than 0 = -C
      add(b.lhs[row].is_zero() ? b.rhs[row] : low.residuals[i]);
      made_->labels.push_back("equation " + low.label(i));
    }
  }

  void add_fixes() {
    for (const auto& [leaf, value] : request_.fix) {
      const Expr number = symbol(Kind::slot, text("fixed_", made_->fixed.size() + 1));
      made_->fixed.push_back(number);
      made_->given.push_back(number);
      const Expr own = resolve(*made_->model, leaf);
      const auto at = made_->column.find(own);
      made_->fixed_unknown.push_back(at == made_->column.end() ? std::nullopt : std::optional(at->second));
      add(own - number);
    }
  }

  void add(Expr e) {
    differentiate_inputs(e);
    made_->rows.push_back(substitute(e, inputs_));
  }

  /// Adds derivatives of inputs that are known as expressions, if the reduced equations contain them.
  void differentiate_inputs(Expr e) {
    for (Expr leaf : leaves({&e, 1})) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind != Kind::input || inputs_.count(leaf) || !inputs_.count(s.base)) continue;
      const auto& numeric = request_.numeric_inputs;
      if (std::find(numeric.begin(), numeric.end(), s.base) != numeric.end()) continue;
      inputs_[leaf] = total_derivative(inputs_.at(s.base), s.order);
    }
  }

  void check_known() const {
    const std::unordered_set<Expr> given(made_->given.begin(), made_->given.end());
    for (Expr leaf : leaves(made_->rows)) {
      const Symbol& s = symbol_of(leaf);
      if (given.count(leaf) || made_->column.count(leaf) || s.kind == Kind::constant) continue;
      if (s.kind == Kind::input) throw Error(missing_input(leaf, inputs_));
      std::vector<std::string> names;
      for (Expr e : made_->unknowns) names.push_back(symbol_of(e).name);
      throw Error(
          text("'", to_text(leaf), "' is not an unknown of this model.", did_you_mean(s.name, names)));
    }
  }

  void compile() {
    made_->jacobian = sparse_jacobian(made_->rows, made_->unknowns);
    std::vector<Expr> leaves = made_->unknowns, slopes;
    leaves.insert(leaves.end(), made_->given.begin(), made_->given.end());
    for (const Entry& entry : made_->jacobian) slopes.push_back(entry.value);
    made_->values.emplace(with_scaled_exponentials(made_->rows), leaves);
    made_->slopes.emplace(with_scaled_exponentials(slopes), leaves);
    std::vector<Eigen::Triplet<double>> entries;
    for (const Entry& entry : made_->jacobian) entries.emplace_back(entry.row, entry.column, 0);
    auto& J = made_->pattern;
    J.resize(static_cast<Index>(made_->rows.size()), static_cast<Index>(made_->unknowns.size()));
    J.setFromTriplets(entries.begin(), entries.end());
    for (const Entry& entry : made_->jacobian)
      made_->place.push_back(&J.coeffRef(entry.row, entry.column) - J.valuePtr());
  }

  const StartRequest& request_;
  Substitution inputs_;
  std::shared_ptr<StartEquations> made_;
};

/// Values of t and of the parameters, those in the expressions of inputs included.
std::unordered_map<Expr, double> parameter_values(const Model& low, const Model& model,
                                                  const StartRequest& request) {
  std::unordered_map<Expr, double> known{{time_symbol(), request.t}};
  std::vector<Expr> parameters = low.parameters;
  for (const auto& [leaf, e] : request.inputs)
    for (Expr p : leaves({&e, 1}))
      if (symbol_of(p).kind == Kind::parameter) parameters.push_back(p);
  for (Expr p : parameters) {
    const auto given = request.parameters.find(p), own = model.values.find(p);
    std::optional<Expr> value = symbol_of(p).value;
    if (own != model.values.end()) value = own->second;
    if (given != request.parameters.end()) value = given->second;
    if (!value)
      throw Error(text("parameter '", symbol_of(p).name, "' has no value; give one: sys:with{ ",
                       symbol_of(p).name, " = … } or params = { ", symbol_of(p).name, " = … }"));
    known[p] = value->is_constant() ? constant_value(*value) : pendula::evaluate({&*value, 1}, {})[0];
  }
  return known;
}

using Words = std::vector<std::uint32_t>;

void add_address(Words& key, const void* at) {
  const auto address = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(at));
  key.insert(key.end(), {static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(address >> 32)});
}

StartEquationsPtr start_equations(const ModelPtr& model, const ModelPtr& low, const StartRequest& request,
                                  const std::unordered_map<Expr, double>& known) {
  constexpr std::size_t equations = 200'000;  // an entry counts as 1000 more
  static LruCache<Words, StartEquationsPtr, WordsHash> remembered(equations);
  Words key{request.keep_invariants};
  add_address(key, model.get());
  add_address(key, low.get());
  for (const auto& [leaf, value] : request.fix) key.push_back(leaf.id());
  std::map<std::uint32_t, std::uint32_t> inputs;
  for (const auto& [leaf, e] : request.inputs) inputs[leaf.id()] = e.id();
  key.push_back(static_cast<std::uint32_t>(inputs.size()));
  for (const auto& [leaf, e] : inputs) key.insert(key.end(), {leaf, e});
  for (Expr leaf : request.numeric_inputs) key.push_back(leaf.id());
  if (const StartEquationsPtr* found = remembered.find(key)) return *found;
  const StartEquationsPtr made = Builder(model, low, request, known)();
  return remembered.insert(key, made, 1000 + made->rows.size());
}

}  // namespace

StartSystem::StartSystem(const ModelPtr& m, const StartRequest& r)
    : low(index_one_form(m, values_near(r))),
      model(*m),
      request(with_own_guesses(*m, r)),
      known(parameter_values(*low, *m, r)),
      equations_(start_equations(m, low, r, known)),
      unknowns(equations_->unknowns),
      rows(equations_->rows),
      state_count(equations_->state_count),
      first_fix(equations_->first_fix) {
  const std::size_t others = equations_->given.size() - equations_->fixed.size();
  for (std::size_t k = 0; k < others; ++k) given_.push_back(known.at(equations_->given[k]));
  for (const auto& [leaf, value] : request.fix) given_.push_back(value);
  guessed_.assign(unknowns.size(), 0);
  for (const auto& [leaf, value] : request.guess)
    if (const auto j = position(resolve(model, leaf))) guessed_[*j] = 1;
  Magnitudes m_units = measure();
  unit = std::move(m_units.unknowns);
  row_unit = std::move(m_units.rows);
}

Magnitudes StartSystem::measure() const {
  constexpr std::size_t most = 4, large = 2000;  // cached patterns; systems up to this size are cached
  SizeEquations::Anchors anchors;
  const std::unordered_map<Expr, double> given_sizes(request.sizes.begin(), request.sizes.end());
  for (std::size_t k = 0; k < fixes(); ++k) {
    const auto j = fixed_unknown(k);
    const auto& [leaf, value] = request.fix[k];
    if (!j) continue;
    const auto own = given_sizes.find(leaf);
    anchors.emplace_back(*j, own == given_sizes.end() ? value : own->second);
  }
  if (given_sizes.empty())  // the values of a run may be rounding errors
    for (const auto& [leaf, value] : request.guess)
      if (const auto j = position(resolve(model, leaf))) anchors.emplace_back(*j, value);
  auto& kept = equations_->sizes;
  for (auto it = kept.begin(); it != kept.end(); ++it)
    if (auto found = (**it)(given_, anchors)) {
      std::rotate(kept.begin(), it, it + 1);
      return std::move(*found);
    }
  auto made = std::make_unique<SizeEquations>(rows, first_fix, unknowns, equations_->given, given_);
  Magnitudes found = *(*made)(given_, anchors);
  if (rows.size() > large) return found;
  kept.insert(kept.begin(), std::move(made));
  kept.resize(std::min(kept.size(), most));
  return found;
}

Expr StartSystem::equation(std::size_t row) const {
  if (row < first_fix) return rows[row];
  const std::size_t k = row - first_fix;
  return substitute(rows[row], {{equations_->fixed[k], Expr(request.fix[k].second)}});
}

std::optional<Index> StartSystem::position(Expr leaf) const {
  const auto it = equations_->column.find(leaf);
  return it == equations_->column.end() ? std::nullopt : std::optional(it->second);
}

std::vector<char> StartSystem::fixed() const {
  std::vector<char> list(unknowns.size(), 0);
  for (std::size_t k = 0; k < fixes(); ++k)
    if (const auto j = fixed_unknown(k)) list[*j] = 1;
  return list;
}

Vec StartSystem::residual(const Vec& w) const {
  const auto values = this->values(w);
  return Eigen::Map<const Vec>(values.data(), static_cast<Index>(values.size())).cwiseQuotient(row_unit);
}

Vec StartSystem::rounding_errors(const Vec& w) const {
  const auto errors = equations_->values->rounding_errors(leaf_values(w));
  return Eigen::Map<const Vec>(errors.data(), static_cast<Index>(errors.size())).cwiseQuotient(row_unit);
}

Eigen::SparseMatrix<double> StartSystem::jacobian(const Vec& w) const {
  const auto values = (*equations_->slopes)(leaf_values(w));
  Eigen::SparseMatrix<double> J = equations_->pattern;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [i, j] = std::pair(equations_->jacobian[k].row, equations_->jacobian[k].column);
    J.valuePtr()[equations_->place[k]] = values[k] * (unit[j] / row_unit[i]);
  }
  return J;
}

Mat StartSystem::top_jacobian(const Vec& w) const {
  StartEquations& e = *equations_;
  if (!e.top_slopes) {
    e.top = dae::top_jacobian(*low);
    std::vector<Expr> slopes, leaves = unknowns;
    for (const Entry& entry : e.top) slopes.push_back(substitute(entry.value, e.inputs));
    leaves.insert(leaves.end(), e.given.begin(), e.given.end());
    e.top_slopes.emplace(with_scaled_exponentials(slopes), leaves);
  }
  const auto [value, noise] = evaluate_stable(*e.top_slopes, w, given_, unit);
  const auto first_row = static_cast<Index>(low->invariants.size()),
             n = static_cast<Index>(low->variables.size()), first = static_cast<Index>(state_count);
  Mat J = Mat::Zero(n, n);
  for (std::size_t k = 0; k < e.top.size(); ++k)
    if (const auto [i, j] = std::pair(e.top[k].row, e.top[k].column); !noise[k])
      J(i, j) = value[k] * unit[first + j] / row_unit[first_row + i];
  return J;
}

std::vector<double> StartSystem::leaf_values(const Vec& w) const {
  std::vector<double> values(w.begin(), w.end());
  values.insert(values.end(), given_.begin(), given_.end());
  return values;
}

std::unordered_map<Expr, double> StartSystem::point(const Vec& w) const {
  auto p = known;
  for (std::size_t j = 0; j < unknowns.size(); ++j) p[unknowns[j]] = w[j];
  return p;
}

std::string StartSystem::label(std::size_t row) const {
  if (row < first_fix) return equations_->labels[row];
  const auto& [leaf, value] = request.fix[row - first_fix];
  return text(to_text(leaf), " = ", rounded(value));
}

}  // namespace pendula::dae
