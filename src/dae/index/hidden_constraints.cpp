#include "dae/index/hidden_constraints.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/index/array_conditions.hpp"
#include "dae/rank/modular.hpp"
#include "dae/regularise/elimination.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t most_rows = 80;  // equations; every elimination substitutes in all others
constexpr double longest_row = 300;    // operations; longer rows are not used for elimination

class Elimination {
 public:
  Elimination(const Model& m, const std::vector<Expr>& states, std::vector<DerivedRow> rows)
      : m_(m), ordered_(states) {
    for (const Variable& v : m.variables) bases_.push_back(v.leaf);
    for (Expr base : bases_) place_.emplace(base, place_.size());
    states_.insert(states.begin(), states.end());
    for (const DerivedRow& r : rows)
      rows_.push_back({without_cancelled(r.residual, bases_), r.equation, r.derivative, {}});
  }

  std::vector<Constraint> conditions(int wanted) {
    for (bool going = true; going;) {
      poll_interrupt();
      collect(wanted);
      going = static_cast<int>(found_.size()) < wanted && step();
    }
    for (std::size_t k = 0; k < found_.size() && static_cast<int>(found_.size()) < wanted; ++k)
      derive(found_[k]);
    std::stable_sort(found_.begin(), found_.end(),
                     [](const Constraint& a, const Constraint& b) { return a.derivative < b.derivative; });
    return found_;
  }

 private:
  struct Row {
    Expr e;
    int equation, derivative;
    std::vector<std::string> with;  ///< labels of the rows that were substituted
    bool done = false;
    std::optional<std::vector<std::pair<Expr, Expr>>> slopes = {};  ///< empty: not computed yet
  };

  /// The unknowns that a row can be solved for, each with the derivative of the row.
  const std::vector<std::pair<Expr, Expr>>& slopes(Row& r) const {
    if (r.slopes) return *r.slopes;
    r.slopes.emplace();
    if (!is_short(r.e, longest_row)) return *r.slopes;
    const auto unknowns = eliminated_in(r.e);
    const auto derivatives = gradient(r.e, unknowns);
    for (std::size_t k = 0; k < unknowns.size(); ++k)
      r.slopes->emplace_back(unknowns[k], tidied(derivatives[k]));
    return *r.slopes;
  }

  /// Sorted by order of derivative, then by the order of the model's unknowns, so that the result does not
  /// depend on the session.
  std::vector<Expr> eliminated_in(Expr e) const {
    std::vector<Expr> found;
    for (Expr leaf : leaves({&e, 1}))
      if (place_.count(symbol_of(leaf).base) && !states_.count(leaf)) found.push_back(leaf);
    std::sort(found.begin(), found.end(), [&](Expr a, Expr b) {
      const Symbol &s = symbol_of(a), &t = symbol_of(b);
      return s.order != t.order ? s.order < t.order : place_.at(s.base) < place_.at(t.base);
    });
    return found;
  }

  std::string label(const Row& r) const {
    return m_.label(static_cast<std::size_t>(r.equation)) + primes(r.derivative);
  }

  /// Rows without unknowns to eliminate become conditions if they are independent of those found so far.
  void collect(int wanted) {
    for (Row& r : rows_) {
      if (r.done || !eliminated_in(r.e).empty()) continue;
      r.done = true;
      if (r.e.is_constant() || static_cast<int>(found_.size()) >= wanted || generic::is_zero(r.e)) continue;
      const auto [block, row] = m_.origin[r.equation];
      std::string from = label(r);
      if (!r.with.empty()) from += " with " + join(r.with, ", ");
      found_.push_back({with_leading_sign(simplify(r.e), ordered_),
                        r.with.empty() ? std::optional(block) : std::nullopt, row, r.derivative, from});
      if (!independent()) found_.pop_back();
    }
  }

  bool independent() const {
    std::vector<Expr> residuals;
    for (const Constraint& c : found_) residuals.push_back(c.residual);
    const auto n = static_cast<int>(found_.size());
    return modular_rank(sparse_jacobian(residuals, ordered_), n, static_cast<int>(ordered_.size())).rank == n;
  }

  struct Pivot {
    std::size_t row;
    Expr leaf, slope;
    double cost;
  };

  /// The cheapest pivot: constant coefficients before those with t and parameters before those with states;
  /// rows with few unknowns first.
  std::optional<Pivot> cheapest() {
    std::optional<Pivot> best;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].done) continue;
      const auto& found = slopes(rows_[i]);
      for (const auto& [leaf, slope] : found) {
        if (slope.is_zero() || !eliminated_in(slope).empty()) continue;
        // constants before parameters before states; then few differentiations, then short rows
        const double kind = slope.is_constant() ? 0 : has_state(slope) ? 2000 : 1000;
        const double cost = kind + 100.0 * rows_[i].derivative + 10.0 * static_cast<double>(found.size()) -
                            symbol_of(leaf).order;
        if (!best || cost < best->cost) best = Pivot{i, leaf, slope, cost};
      }
    }
    return best;
  }

  bool has_state(Expr e) const {
    for (Expr leaf : leaves({&e, 1}))
      if (states_.count(leaf)) return true;
    return false;
  }

  bool step() {
    const auto pivot = cheapest();
    if (!pivot || generic::is_zero(pivot->slope)) return false;
    Row& solved = rows_[pivot->row];
    solved.done = true;
    const Expr value = tidied(-substitute(solved.e, {{pivot->leaf, Expr(0)}}) / pivot->slope);
    solved_.push_back({pivot->leaf, value});
    for (Row& r : rows_) {
      if (r.done) continue;
      const auto inside = eliminated_in(r.e);
      if (std::find(inside.begin(), inside.end(), pivot->leaf) == inside.end()) continue;
      r.e = without_cancelled(substitute(r.e, {{pivot->leaf, value}}), bases_);
      r.slopes.reset();
      note(r, label(solved));
      for (const std::string& earlier : solved.with) note(r, earlier);
    }
    return true;
  }

  /// The derivative of a condition is a condition as well, after substitution of the solved unknowns.
  void derive(Constraint c) {
    constexpr double longest_derived = 20'000;  // operations; generic::is_zero() evaluates them
    Expr e = total_derivative(c.residual);
    for (std::size_t round = 0; round <= solved_.size() && !eliminated_in(e).empty(); ++round)
      for (auto it = solved_.rbegin(); it != solved_.rend(); ++it)
        e = substitute(e, {{it->first, it->second}});
    if (!eliminated_in(e).empty() || !is_short(e, longest_derived) || generic::is_zero(e)) return;
    found_.push_back(
        {with_leading_sign(simplify(e), ordered_), -1, c.row, c.derivative + 1, "d/dt " + c.label});
    if (!independent()) found_.pop_back();
  }

  static void note(Row& r, const std::string& label) {
    if (std::find(r.with.begin(), r.with.end(), label) == r.with.end()) r.with.push_back(label);
  }

  const Model& m_;
  std::vector<Expr> ordered_, bases_;  ///< states in their order; unknowns
  std::unordered_map<Expr, std::size_t> place_;
  std::unordered_set<Expr> states_;
  std::vector<Row> rows_;
  std::vector<std::pair<Expr, Expr>> solved_;  ///< leaf, its solution
  std::vector<Constraint> found_;
};

}  // namespace

std::vector<DerivedRow> rows_by_offsets(const Model& m, const Offsets& o) {
  std::vector<DerivedRow> rows;
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    rows.push_back({m.residuals[i], static_cast<int>(i), 0});
    for (int k = 1; k <= o.c[i]; ++k)
      rows.push_back({total_derivative(rows.back().residual), static_cast<int>(i), k});
  }
  return rows;
}

std::vector<DerivedRow> rows_up_to(const Model& m, int order) {
  Offsets same;
  same.c.assign(m.residuals.size(), order);
  return rows_by_offsets(m, same);
}

bool on_states_only(const Model& m, const std::vector<Constraint>& constraints) {
  const auto x = m.states();
  const std::unordered_set<Expr> states(x.begin(), x.end());
  std::unordered_set<Expr> bases;
  for (const Variable& v : m.variables) bases.insert(v.leaf);
  for (const Constraint& c : constraints)
    for (Expr leaf : leaves({&c.residual, 1}))
      if (bases.count(symbol_of(leaf).base) && !states.count(leaf)) return false;
  return true;
}

std::vector<Constraint> hidden_constraints_on_states(const Model& m, const std::vector<Expr>& states,
                                                     std::vector<DerivedRow> rows, int wanted) {
  if (rows.size() > most_rows || wanted <= 0) return {};
  return Elimination(m, states, std::move(rows)).conditions(wanted);
}

}  // namespace pendula::dae
