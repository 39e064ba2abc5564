// Conversions by new unknowns (regularise.hpp, 2 and 4).
#include "dae/regularise/regularise.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/regularise/null_vectors.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

/// The first name of w1, w2 … that is not in use.
Expr fresh_unknown(const Equations& e) {
  std::unordered_set<std::string> taken;
  for (Expr leaf : leaves(e.residuals)) taken.insert(symbol_of(leaf).name);
  for (Expr v : e.variables) taken.insert(symbol_of(v).name);
  for (int k = 1;; ++k)
    if (!taken.count(text("w", k))) return newly_declared({symbol(Kind::variable, text("w", k))})[0];
}

/// The unknowns of a circuit of equations, expressed by new unknowns w and the pivot x_l.
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

  void apply(Equations& e, std::vector<std::string>& log, Substitution& definitions) const {
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
      log.push_back(
          text("new unknown:  ", to_text(w), " = ", to_text(value), "   ", validity_text(v_.nonzero)));
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
      e.notes[i] = "with the new unknowns substituted";
      log.push_back(text(e.labels[i], " becomes  0 = ", to_text(changed)));
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

Step convert_by_substitution(Equations& e, const Structure& s, std::vector<std::string>& log,
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
    for (Expr& x : candidate.u) x = tidied(x / pivot);  // v_l = 1 is needed here, even with fractions
    if (SharedCombination(s, variables, candidate, l).allowed(e.variables) &&
        (!best || candidate.complexity() < best->first.complexity()))
      best = {candidate, l};
  }
  if (!best) return Step::nothing;
  SharedCombination(s, variables, best->first, best->second).apply(e, log, definitions);
  add_new(e.nonzero, best->first.nonzero);
  return Step::changed;
}

namespace {

/// Two unknowns without derivatives that occur in some equations only as u_j + r u_k with a number r.
struct SharedPair {
  int j, k;
  Expr ratio;                     ///< r
  std::vector<std::size_t> rows;  ///< numbers of these equations
};

std::vector<char> algebraic_unknowns(const Structure& s, std::size_t n) {
  std::vector<char> algebraic(n, 1);
  for (const auto& row : s.sigma)
    for (const SignatureEntry& entry : row)
      if (entry.order > 0) algebraic[entry.variable] = 0;
  return algebraic;
}

/// Pairs shared by at least two equations, the most frequent first.
std::vector<SharedPair> shared_pairs(const Equations& e, const Structure& s) {
  constexpr std::size_t most_in_row = 8;
  const auto algebraic = algebraic_unknowns(s, e.variables.size());
  std::vector<SharedPair> pairs;
  for (std::size_t i = 0; i < s.sigma.size(); ++i) {
    std::vector<int> inside;
    std::vector<Expr> unknowns;
    for (const SignatureEntry& entry : s.sigma[i])
      if (algebraic[entry.variable]) {
        inside.push_back(entry.variable);
        unknowns.push_back(e.variables[entry.variable]);
      }
    if (inside.size() > most_in_row) continue;
    const auto slopes = gradient(e.residuals[i], unknowns);
    for (std::size_t a = 0; a < inside.size(); ++a)
      for (std::size_t b = a + 1; b < inside.size(); ++b) {
        const auto ratio = constant_ratio(slopes[b], slopes[a]);
        if (!ratio) continue;
        const auto known = std::find_if(pairs.begin(), pairs.end(), [&](const SharedPair& p) {
          return p.j == inside[a] && p.k == inside[b] && p.ratio == *ratio;
        });
        if (known == pairs.end())
          pairs.push_back({inside[a], inside[b], *ratio, {i}});
        else
          known->rows.push_back(i);
      }
  }
  std::erase_if(pairs, [](const SharedPair& p) { return p.rows.size() < 2; });
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const SharedPair& a, const SharedPair& b) { return a.rows.size() > b.rows.size(); });
  return pairs;
}

/// Adds the equation w = u_j + r u_k and replaces u_j in the equations that share the pair.
Expr introduce(Equations& e, const SharedPair& p, std::vector<std::string>& log) {
  const Expr w = fresh_unknown(e), u = e.variables[p.j], other = p.ratio * e.variables[p.k],
             value = tidied(u + other);
  e.variables.push_back(w);
  for (std::size_t i : p.rows) {
    e.residuals[i] = without_cancelled(substitute(e.residuals[i], {{u, w - other}}), e.variables);
    e.notes[i] = "with the new unknown substituted";
  }
  e.residuals.push_back(w - value);
  e.labels.push_back(text("(", e.labels.size() + 1, ")"));
  e.notes.push_back("definition of " + to_text(w));
  e.differentiated.push_back(0);
  log.push_back(text("new unknown:  ", to_text(w), " = ", to_text(value), "   valid everywhere"));
  for (std::size_t i : p.rows) log.push_back(text(e.labels[i], " becomes  0 = ", to_text(e.residuals[i])));
  return w;
}

}  // namespace

Step convert_by_shared_pair(Equations& e, const Structure& s, std::vector<std::string>& log,
                            Substitution& definitions) {
  constexpr std::size_t affordable = 60, tries = 20;
  if (e.residuals.size() > affordable) return Step::nothing;
  const auto pairs = shared_pairs(e, s);
  for (std::size_t k = 0; k < std::min(tries, pairs.size()); ++k) {
    Equations changed = e;
    std::vector<std::string> lines;
    const Expr w = introduce(changed, pairs[k], lines);
    const Structure there = structure_of(changed);
    if (!there.matched || there.singular_on_solutions || there.offsets.value >= s.offsets.value) continue;
    const Expr u = e.variables[pairs[k].j], other = e.variables[pairs[k].k];
    definitions[w] = tidied(u + pairs[k].ratio * other);
    e = std::move(changed);
    log.insert(log.end(), lines.begin(), lines.end());
    return Step::changed;
  }
  return Step::nothing;
}

}  // namespace pendula::dae
