#include "dae/conversion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/rank.hpp"
#include "expr/generic.hpp"
#include "expr/linalg.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr int max_conversions = 30;
constexpr std::size_t largest_circuit = 200;  // equations in one dependent set that is searched for
constexpr double ratio_denominators = 5040;   // constant ratios p/q that are recognised: q divides 7!
constexpr double longest_entry = 60;          // operations in an entry of J that null vectors are formed of
constexpr std::size_t symbolic_circuit = 8;   // beyond it null vectors are too long to be of use

std::vector<Entry> transposed(std::vector<Entry> entries) {
  for (Entry& e : entries) std::swap(e.row, e.column);
  return entries;
}

/// The rows of a set, renumbered.
std::vector<Entry> rows_of(const std::vector<Entry>& entries, const std::vector<int>& rows) {
  std::vector<Entry> part;
  for (const Entry& e : entries)
    if (const auto it = std::find(rows.begin(), rows.end(), e.row); it != rows.end())
      part.push_back({static_cast<int>(it - rows.begin()), e.column, e.value});
  return part;
}

bool dependent(const std::vector<Entry>& entries, const std::vector<int>& rows, int columns) {
  const auto n = static_cast<int>(rows.size());
  return generic_rank(rows_of(entries, rows), n, columns).rank < n;
}

/// A set of dependent rows of which none can be left out: exactly one null vector, without zeros. Empty if
/// the search would be too long.
std::vector<int> circuit(const std::vector<Entry>& entries, int n) {
  std::vector<int> set(n);
  std::iota(set.begin(), set.end(), 0);
  const auto all = modular_rank(entries, n, n);
  if (!all.dependent_rows.empty()) {  // pivots and one dependent row
    std::unordered_set<int> rest(all.dependent_rows.begin() + 1, all.dependent_rows.end());
    std::erase_if(set, [&](int i) { return rest.count(i) > 0; });
  }
  for (std::size_t part = set.size() / 2; part >= 1; part /= 2)  // large pieces first
    for (std::size_t at = 0; at < set.size();) {
      poll_interrupt();
      std::vector<int> less(set.begin(), set.begin() + static_cast<std::ptrdiff_t>(at));
      less.insert(less.end(), set.begin() + static_cast<std::ptrdiff_t>(std::min(at + part, set.size())),
                  set.end());
      if (!less.empty() && dependent(entries, less, n))
        set = std::move(less);
      else
        at += part;
    }
  return set;
}

/// The null vector of the rows of a circuit: Σ u_i row_i = 0.
std::optional<VecX> null_vector_of(const std::vector<Entry>& J, const std::vector<int>& rows, int n) {
  const auto part = rows_of(J, rows);
  const auto size = static_cast<int>(rows.size());
  const auto rank = modular_rank(part, size, n);
  const std::unordered_set<int> skipped(rank.dependent_columns.begin(), rank.dependent_columns.end());
  std::vector<int> position(n, -1);
  int columns = 0;
  for (int j = 0; j < n; ++j)
    if (!skipped.count(j)) position[j] = columns++;
  MatX m = MatX::Zero(columns, size);
  for (const Entry& e : part)
    if (position[e.column] >= 0) m(position[e.column], e.row) = e.value;
  for (Expr e : entries(m))
    if (!is_short(e, longest_entry)) return {};
  auto u = linalg::null_vector(m);
  if (!u || std::any_of(u->begin(), u->end(), [](Expr x) { return !is_short(x); })) return {};
  for (Expr& e : *u) {
    e = tidied(e);
    if (e.is_zero() || generic::is_zero(e)) return {};
  }
  return u;
}

/// Every denominator in e that is not a number.
std::vector<Expr> denominators(Expr e) {
  std::vector<Expr> found;
  for (Expr node : topological({&e, 1})) {
    if (node.op() == Op::div && !node.operand(1).is_constant()) found.push_back(node.operand(1));
    if (node.op() == Op::pow)
      if (const mpq_class* q = exact_value(node.operand(1)); q && *q < 0) found.push_back(node.operand(0));
  }
  return found;
}

/// u scaled so that u_l = 1, and where that is allowed.
struct Scaled {
  std::vector<Expr> u;
  std::vector<Expr> nonzero;
  int complexity() const {
    int unknowns = 0;
    for (Expr e : nonzero)
      for (Expr leaf : leaves({&e, 1})) unknowns += symbol_of(leaf).kind == pendula::Kind::variable ? 10 : 1;
    return unknowns;
  }
};

/// a/b where it is the same rational number everywhere, whatever the form of a and b.
std::optional<Expr> constant_ratio(Expr a, Expr b) {
  const std::vector<Expr> both{a, b};
  const auto at = pendula::evaluate(both, random_point(both, 0));
  const double near = std::round(at[0] / at[1] * ratio_denominators) / ratio_denominators;
  if (!(std::fabs(near) < 1e6)) return {};
  const Expr ratio(near);
  return generic::is_zero(a - ratio * b) ? std::optional(ratio) : std::nullopt;
}

Scaled scaled(const VecX& u, std::size_t l) {
  Scaled s;
  const Expr pivot = u[static_cast<Index>(l)];
  for (Expr e : u) s.u.push_back(constant_ratio(e, pivot).value_or(tidied(e / pivot)));
  for (Expr e : s.u)
    for (Expr d : denominators(e))
      if (std::find(s.nonzero.begin(), s.nonzero.end(), d) == s.nonzero.end()) s.nonzero.push_back(d);
  if (s.nonzero.size() == 1) {  // without fractions: multiplied by the denominator where that removes them
    Scaled whole = s;
    for (Expr& e : whole.u) e = tidied(e * s.nonzero[0]);
    if (std::all_of(whole.u.begin(), whole.u.end(), [](Expr e) { return denominators(e).empty(); }))
      return whole;
  }
  return s;
}

/// Highest order of every variable in the vector; -1 where it does not occur.
std::vector<int> orders_in(const std::vector<Expr>& vector, const std::vector<Expr>& variables) {
  std::vector<int> order(variables.size(), -1);
  for (Expr leaf : leaves(vector)) {
    const Symbol& s = symbol_of(leaf);
    const auto it = std::find(variables.begin(), variables.end(), s.base);
    if (it != variables.end()) {
      int& here = order[static_cast<std::size_t>(it - variables.begin())];
      here = std::max(here, s.order);
    }
  }
  return order;
}

std::string domain_text(const std::vector<Expr>& nonzero) {
  std::vector<std::string> parts;
  for (Expr e : nonzero) parts.push_back(to_text(e) + " ≠ 0");
  return nonzero.empty() ? "valid everywhere" : "valid where " + join(parts, ", ");
}

/// "+ x y (1)", "- (2)"; a sum as multiplier in parentheses.
std::string factor_text(Expr u, const std::string& label, bool first) {
  std::string size = to_text(u);
  const bool negative = size.starts_with("-") && size.find_first_of("+-", 1) == std::string::npos;
  if (negative) size = to_text(tidied(-u));
  if (!negative && size.find_first_of("+-") != std::string::npos) size = "(" + size + ")";
  const std::string sign = first ? (negative ? "-" : "") : (negative ? " - " : " + ");
  return sign + (size == "1" ? "" : size + " ") + label;
}

void add_new(std::vector<Expr>& list, const std::vector<Expr>& more) {
  for (Expr e : more)
    if (std::find(list.begin(), list.end(), e) == list.end()) list.push_back(e);
}

/// A name w1, w2 … that no symbol of the equations has.
Expr fresh_unknown(const Equations& e) {
  std::unordered_set<std::string> taken;
  for (Expr leaf : leaves(e.residuals)) taken.insert(symbol_of(leaf).name);
  for (Expr v : e.variables) taken.insert(symbol_of(v).name);
  for (int k = 1;; ++k)
    if (!taken.count(text("w", k))) return symbol(pendula::Kind::variable, text("w", k));
}

/// One substitution: the unknowns of the circuit and how they are expressed by w and the pivot x_l.
class SharedCombination {
 public:
  SharedCombination(const Structure& s, std::vector<int> variables, Scaled v, std::size_t l)
      : s_(s), variables_(std::move(variables)), v_(std::move(v)), l_(l) {
    for (std::size_t i = 0; i < s.sigma.size(); ++i)
      if (leading(static_cast<int>(i))) highest_ = std::max(highest_, s.offsets.c[i]);
  }

  bool allowed(const std::vector<Expr>& all) const {
    const auto& d = s_.offsets.d;
    const auto order = orders_in(v_.u, all);
    for (int j : variables_)
      if (d[j] < highest_ || order[j] >= d[j] - highest_) return false;
    for (std::size_t j = 0; j < order.size(); ++j)
      if (order[j] > d[j] - highest_) return false;
    return true;
  }

  void apply(Equations& e, std::vector<std::string>& story, Substitution& definitions) const {
    const auto& d = s_.offsets.d;
    const int l = variables_[l_];
    const Expr pivot = derivative_leaf(e.variables[l], d[l] - highest_);
    const std::vector<Expr> before = e.variables;
    std::vector<std::pair<int, Expr>> replaced;  // x_j^(d_j - C) = w_j + (v_j/v_l) x_l^(d_l - C)
    for (std::size_t k = 0; k < variables_.size(); ++k) {
      if (k == l_) continue;
      const int j = variables_[k];
      const Expr top = derivative_leaf(before[j], d[j] - highest_), share = v_.u[k] * pivot;
      const Expr w = fresh_unknown(e), value = tidied(top - share);
      replaced.push_back({j, w + share});
      definitions[w] = value;
      e.variables.push_back(w);
      e.residuals.push_back(w - value);
      e.labels.push_back(text("(", e.labels.size() + 1, ")"));
      e.notes.push_back("definition of " + to_text(w));
      e.differentiated.push_back(0);
      story.push_back(
          text("new unknown:  ", to_text(w), " = ", to_text(value), "   ", domain_text(v_.nonzero)));
    }
    for (int i = 0; i < static_cast<int>(s_.sigma.size()); ++i) {
      if (!leading(i)) continue;
      Substitution put;
      for (const auto& [j, value] : replaced)
        put[derivative_leaf(before[j], d[j] - s_.offsets.c[i])] =
            total_derivative(value, highest_ - s_.offsets.c[i]);
      const Expr changed = without_cancelled(substitute(e.residuals[i], put), e.variables);
      if (changed == e.residuals[i]) continue;
      e.residuals[i] = changed;
      e.notes[i] = "with the new unknowns put in";
      story.push_back(text(e.labels[i], " becomes  0 = ", to_text(changed)));
    }
  }

 private:
  /// Does equation i contain a leading derivative of a variable of the circuit?
  bool leading(int i) const {
    for (const SignatureEntry& entry : s_.sigma[i])
      if (entry.order == s_.offsets.d[entry.variable] - s_.offsets.c[i] &&
          std::find(variables_.begin(), variables_.end(), entry.variable) != variables_.end())
        return true;
    return false;
  }

  const Structure& s_;
  std::vector<int> variables_;
  Scaled v_;
  std::size_t l_;
  int highest_ = 0;  // C: the largest offset of an equation with such a derivative
};

}  // namespace

Step convert_by_combination(Equations& e, const Structure& s, std::vector<std::string>& story) {
  const auto n = static_cast<int>(e.variables.size());
  if (e.residuals.size() > largest_circuit) return Step::nothing;
  const auto rows = circuit(s.jacobian, n);
  if (rows.size() > symbolic_circuit) return Step::nothing;
  const auto u = null_vector_of(s.jacobian, rows, n);
  if (!u) return Step::nothing;
  const auto& [c, d] = std::pair(s.offsets.c, s.offsets.d);
  int least = c[rows[0]];
  for (int i : rows) least = std::min(least, c[i]);
  std::optional<Scaled> best;
  std::size_t replaced = 0;
  for (std::size_t l = 0; l < rows.size(); ++l) {
    if (c[rows[l]] != least) continue;
    const Scaled candidate = scaled(*u, l);
    const auto order = orders_in(candidate.u, e.variables);
    bool allowed = true;
    for (std::size_t j = 0; j < order.size(); ++j)
      allowed = allowed && (order[j] < 0 || order[j] < d[j] - least);
    if (allowed && (!best || candidate.complexity() <= best->complexity())) best = candidate, replaced = l;
  }
  if (!best) return Step::nothing;
  Expr sum = 0;
  std::string how;
  int times = 0;
  std::vector<std::size_t> terms(rows.size());
  std::iota(terms.begin(), terms.end(), std::size_t{0});
  std::swap(terms[0], terms[replaced]);  // "(2) - x (1)" reads as what is done to (2)
  for (std::size_t k : terms) {
    const int i = rows[k];
    sum += best->u[k] * total_derivative(e.residuals[i], c[i] - least);
    std::string label = e.labels[i];
    for (int p = least; p < c[i]; ++p) label += "′";
    how += factor_text(best->u[k], label, how.empty());
    times = std::max(times, e.differentiated[i] + c[i] - least);
  }
  const auto target = static_cast<std::size_t>(rows[replaced]);
  const Step step = replace_equation(e, target, without_cancelled(sum, e.variables), how, story);
  story.back() += ", " + domain_text(best->nonzero);
  if (step == Step::dependent) return step;
  e.differentiated[target] = times;
  add_new(e.nonzero, best->nonzero);
  return step;
}

Step convert_by_substitution(Equations& e, const Structure& s, std::vector<std::string>& story,
                             Substitution& definitions) {
  const auto n = static_cast<int>(e.variables.size());
  if (e.residuals.size() > largest_circuit) return Step::nothing;
  const auto columns = transposed(s.jacobian);
  const auto variables = circuit(columns, n);
  if (variables.size() > symbolic_circuit) return Step::nothing;
  const auto v = null_vector_of(columns, variables, n);
  if (!v) return Step::nothing;
  std::optional<std::pair<Scaled, std::size_t>> best;
  for (std::size_t l = 0; l < variables.size(); ++l) {
    Scaled candidate = scaled(*v, l);
    const Expr pivot = candidate.u[l];
    for (Expr& x : candidate.u) x = tidied(x / pivot);  // here v_l = 1 is needed, fractions or not
    if (SharedCombination(s, variables, candidate, l).allowed(e.variables) &&
        (!best || candidate.complexity() < best->first.complexity()))
      best = {candidate, l};
  }
  if (!best) return Step::nothing;
  SharedCombination(s, variables, best->first, best->second).apply(e, story, definitions);
  add_new(e.nonzero, best->first.nonzero);
  return Step::changed;
}

namespace {

/// Steps until the structure is regular; false if that is not reached.
bool make_regular(Equations& e, Structure& s, Repaired& r) {
  for (int step = 0; step < max_conversions; ++step) {
    poll_interrupt();
    if (!s.matched) {
      r.story.push_back("no unknown is left for equation " + e.labels[s.offsets.unmatched[0]] +
                        ": the model is structurally singular");
      return false;
    }
    Step done = drop_cancelled(e, s, r.story);
    if (done == Step::nothing && s.regular) return true;
    if (done == Step::nothing && s.singular_on_solutions) {
      r.story.push_back(
          "the system Jacobian is regular in general, but singular wherever the equations hold: it contains "
          "the "
          "equations themselves, and what the structure says is wrong");
      return false;
    }
    if (done == Step::nothing) done = eliminate_constant_rows(e, s, r.story);
    if (done == Step::nothing) done = eliminate_by_constants(e, s, r.story);
    if (done == Step::nothing) done = convert_by_combination(e, s, r.story);
    if (done == Step::nothing) done = convert_by_substitution(e, s, r.story, r.definitions);
    if (done != Step::changed) {
      if (done == Step::nothing)
        r.story.push_back(text("the system Jacobian still has rank ", s.rank.rank, " of ", e.variables.size(),
                               ", and no combination or substitution is possible"));
      return false;
    }
    const int before = s.offsets.value;
    const std::size_t unknowns = e.variables.size();
    s = structure_of(e);
    if (s.matched && !s.regular && s.offsets.value > before) {
      r.story.push_back("the conversion did not lower the value of the structure: given up");
      return false;
    }
    r.story.push_back(text("structure: rank of the system Jacobian ", s.rank.rank, " of ", e.variables.size(),
                           s.regular
                               ? text(", valid: ", s.offsets.value,
                                      s.offsets.value == 1 ? " free initial value" : " free initial values")
                               : std::string(s.matched ? ", still singular" : ""),
                           unknowns == e.variables.size() ? "" : " (with the new unknowns)"));
  }
  r.story.push_back(text("given up after ", max_conversions, " conversions"));
  return false;
}

/// Equations as they stand in the model, replaced rows with 0 on the left.
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
      Block& b = blocks[static_cast<std::size_t>(m.origin[i].first)];
      b.lhs[m.origin[i].second] = 0;
      b.rhs[m.origin[i].second] = e.residuals[i];
      const std::string note =
          b.lhs.size() == 1 ? e.notes[i] : text("row ", m.origin[i].second + 1, ": ", e.notes[i]);
      if (!e.notes[i].empty()) b.note = b.lhs.size() == 1 || b.note.empty() ? note : b.note + "; " + note;
    }
  }
  return blocks;
}

/// How often an original equation is differentiated: c_i times, once more where that is needed for the
/// derivative of an original unknown with d_j = 0 (its equation, and those whose leading unknowns it
/// contains).
int differentiations(const Equations& e, const Structure& s, std::size_t originals) {
  std::vector<std::vector<int>> columns(e.residuals.size());
  for (const Entry& entry : s.jacobian) columns[static_cast<std::size_t>(entry.row)].push_back(entry.column);
  std::vector<char> more(e.residuals.size(), 0);
  std::vector<int> reached;
  const auto reach = [&](int j) {
    const int i = s.offsets.equation_of[static_cast<std::size_t>(j)];
    if (!more[static_cast<std::size_t>(i)]) more[static_cast<std::size_t>(i)] = 1, reached.push_back(i);
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

/// The equations with the values of those parameters on which the rank of the system Jacobian depends.
bool put_in_values(const Model& m, Equations& e, const Structure& s, std::vector<std::string>& story) {
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
  story.push_back("with the parameter values " + join(names, ", "));
  return true;
}

}  // namespace

std::optional<Repaired> repair(const ModelPtr& model, std::vector<std::string>* why) {
  Repaired r;
  Equations e = equations_of(*model);
  Structure s = structure_of(e);
  if (s.regular) {  // but perhaps not for the parameter values of this model
    Equations given = e;
    std::vector<std::string> story;
    if (put_in_values(*model, given, s, story))
      if (Structure there = structure_of(given);
          !there.regular || there.offsets.c != s.offsets.c || there.offsets.d != s.offsets.d)
        e = std::move(given), s = std::move(there), r.story = std::move(story);
  }
  const bool done = make_regular(e, s, r);
  if (!done && why) *why = r.story;
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
  options.trace = r.story;
  options.relations = model->relations;
  options.invariants = model->invariants;
  r.model = make_model(r.blocks, options);
  return r;
}

}  // namespace pendula::dae
