#include "dae/structure/analysis.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/consistent_point_rank.hpp"
#include "dae/model/memo.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/differentiation.hpp"
#include "dae/structure/balance.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

std::vector<Expr> leaves_of(const Model& m) {
  std::vector<Expr> list;
  for (const Variable& v : m.variables) list.push_back(v.leaf);
  return list;
}

/// Is J of full rank for the parameter values of the model too? Values are rational or doubles, so that the
/// rank modulo a prime is exact.
bool regular_at_values(const Model& m, const Analysis& a) {
  std::vector<Expr> slopes;
  for (const Entry& e : a.jacobian) slopes.push_back(e.value);
  ParameterValues values;
  for (Expr leaf : leaves(slopes))
    if (const auto it = m.values.find(leaf); it != m.values.end()) values[leaf] = it->second;
  if (values.empty()) return true;
  std::vector<Entry> there = a.jacobian;
  try {
    const auto numbers = at_values(slopes, values);
    for (std::size_t k = 0; k < there.size(); ++k) there[k].value = numbers[k];
  } catch (const Error&) {  // a division by zero: the model says nothing there
    return false;
  }
  std::erase_if(there, [](const Entry& e) { return e.value.is_zero(); });
  const auto n = static_cast<int>(m.variables.size());
  return modular_rank(there, n, n).rank == n;
}

/// Ranks of J at points that satisfy the equations; nothing if they cannot differ or are not affordable.
std::optional<SolutionRanks> ranks_on_solutions(const Model& m, const Analysis& a) {
  if (!m.form.empty() || !m.invariants.empty() || m.variables.size() > OnSolutions::affordable) return {};
  static Remembered<std::optional<SolutionRanks>> remembered;
  auto key = key_of(m);
  if (const auto* known = remembered.find(key)) return *known;
  const Substitution values(m.values.begin(), m.values.end());
  std::vector<Entry> jacobian = a.jacobian;
  for (Entry& e : jacobian) e.value = substitute(e.value, values);
  const OnSolutions there(residuals_at_values(m), leaves_of(m), a.offsets, std::move(jacobian));
  return remembered.keep(std::move(key), there.applies() ? std::optional(there.ranks()) : std::nullopt);
}

Standing standing_of(const Model& m, Analysis& a) {
  const auto n = static_cast<int>(m.variables.size());
  if (a.rank.rank < n) return Standing::identically;
  if (!regular_at_values(m, a)) return Standing::at_values;
  a.solutions = ranks_on_solutions(m, a);
  return a.solutions && a.solutions->always_below(n) ? Standing::on_solutions : Standing::regular;
}

}  // namespace

std::vector<std::uint32_t> key_of(const Model& m) {
  std::vector<std::uint32_t> key;
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    key.push_back(m.residuals[i].id());
    key.push_back(static_cast<std::uint32_t>(m.origin[i].first));
    key.push_back(static_cast<std::uint32_t>(m.origin[i].second));
  }
  for (const Variable& v : m.variables) {
    key.push_back(v.leaf.id());
    key.push_back(static_cast<std::uint32_t>(v.order));
  }
  for (Expr p : m.parameters)
    if (const auto it = m.values.find(p); it != m.values.end()) {
      key.push_back(p.id());
      key.push_back(it->second.id());
    }
  for (const Constraint& c : m.invariants) key.push_back(c.residual.id());
  key.push_back(m.mechanics ? static_cast<std::uint32_t>(m.mechanics->C.size()) + 1 : 0);
  return key;
}

std::vector<Entry> system_jacobian(const std::vector<Expr>& residuals, const std::vector<Expr>& variables,
                                   const Offsets& o, const Signature& sigma) {
  std::vector<Entry> J;
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    std::vector<Expr> leading;
    std::vector<int> where;
    for (const SignatureEntry& e : sigma[i])
      if (o.d[e.variable] - o.c[i] == e.order)
        leading.push_back(derivative_leaf(variables[e.variable], e.order)), where.push_back(e.variable);
    const auto row = gradient(residuals[i], leading);
    for (std::size_t k = 0; k < row.size(); ++k)
      if (!row[k].is_zero()) J.push_back({static_cast<int>(i), where[k], row[k]});
  }
  return J;
}

Signature signature(const Model& m) { return signature(m.residuals, leaves_of(m)); }

Signature signature(const std::vector<Expr>& residuals, const std::vector<Expr>& variables) {
  std::unordered_map<Expr, int> number;
  for (std::size_t j = 0; j < variables.size(); ++j) number[variables[j]] = static_cast<int>(j);
  Signature sigma;
  for (Expr r : residuals) {
    std::unordered_map<int, int> highest;
    for (Expr leaf : leaves({&r, 1})) {
      const Symbol& s = symbol_of(leaf);
      if (const auto it = number.find(s.base); it != number.end()) {
        const auto [entry, made] = highest.try_emplace(it->second, s.order);
        if (!made) entry->second = std::max(entry->second, s.order);
      }
    }
    std::vector<SignatureEntry> row;
    for (const auto& [j, order] : highest) row.push_back({j, order});
    std::sort(row.begin(), row.end(), [](auto& a, auto& b) { return a.variable < b.variable; });
    sigma.push_back(std::move(row));
  }
  return sigma;
}

Pattern incidence(const Model& m) {
  Pattern pattern;
  for (const auto& row : signature(m)) {
    pattern.emplace_back();
    for (const SignatureEntry& e : row) pattern.back().push_back(e.variable);
  }
  return pattern;
}

/// x_j⁽ᵏ⁾ = f for many unknowns: index 0 by its form. Only the diagonal of Σ is written down; the rest, which
/// is dense where f is the solution of a linear system, has orders below k.
static Analysis of_large_ode(const Model& m) {
  Analysis a;
  std::unordered_map<Expr, int> number;
  const auto n = m.variables.size();
  for (std::size_t j = 0; j < n; ++j) number[m.variables[j].leaf] = static_cast<int>(j);
  a.sigma.resize(n);
  a.offsets.c.assign(n, 0);
  a.offsets.d.resize(n), a.offsets.equation_of.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto [block, row] = m.origin[i];
    const int j = number.at(symbol_of(m.blocks[block].lhs[row]).base), order = m.variables[j].order;
    a.sigma[i] = {{j, order}};
    a.offsets.d[j] = order, a.offsets.equation_of[j] = static_cast<int>(i), a.offsets.value += order;
    a.jacobian.push_back({static_cast<int>(i), j, Expr(1)});
  }
  a.rank.rank = static_cast<int>(n);
  a.standing = Standing::regular;
  a.regular = true;
  a.dof = a.offsets.value - static_cast<int>(m.invariants.size());
  return a;
}

static Analysis analysed(const Model& m) {
  constexpr std::size_t small = 60;  // unknowns: Σ is written out
  if (m.variables.size() > small && is_explicit_ode(m)) return of_large_ode(m);
  Analysis a;
  const auto n = static_cast<int>(m.variables.size());
  a.sigma = signature(m);
  a.offsets = offsets(a.sigma, n);
  if (!a.offsets.unmatched.empty()) return a;
  a.jacobian = system_jacobian(m.residuals, leaves_of(m), a.offsets, a.sigma);
  a.rank = generic_rank(a.jacobian, n, n);
  a.standing = standing_of(m, a);
  a.regular = a.standing == Standing::regular;
  if (!a.regular) return a;
  a.index = a.offsets.index();
  a.dof = a.offsets.value;
  a.dof -= static_cast<int>(m.invariants.size());
  return a;
}

/// The answer, remembered: many for small models, few for large ones.
template <class Find>
static auto remembered(const Model& m, Find find) {
  using Answer = decltype(find());
  static Remembered<Answer> small;
  static Remembered<Answer, 4> large;
  auto key = key_of(m);
  for (const Constraint& c : m.invariants)
    key.push_back(static_cast<std::uint32_t>(std::hash<std::string>()(c.label)));
  const bool is_small = m.residuals.size() <= 1000;
  if (const Answer* known = is_small ? small.find(key) : large.find(key)) return *known;
  Answer found = find();
  return is_small ? small.keep(std::move(key), std::move(found))
                  : large.keep(std::move(key), std::move(found));
}

Analysis analyse(const Model& m) {
  if (m.residuals.size() != m.variables.size()) throw Error(imbalance(m));
  return remembered(m, [&] { return analysed(m); });
}

std::vector<Constraint> conditions_by_offsets(const Model& m, const Analysis& a) {
  if (!a.regular) return {};
  if (a.index <= 1 && a.offsets.value == static_cast<int>(m.states().size())) return m.invariants;
  return remembered(m, [&] {
    std::vector<Constraint> list = m.invariants;
    auto more = differentiate(m, a.offsets).constraints;
    list.insert(list.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
    return list;
  });
}

std::string why_not_regular(const Model& m, const Analysis& a) {
  const auto n = m.variables.size();
  switch (a.standing) {
    case Standing::unmatched:
      return imbalance(m);
    case Standing::identically:
      return text("the system Jacobian of the structural analysis is singular (rank ", a.rank.rank, " of ", n,
                  "): the structural index ", a.offsets.index(), " would be wrong");
    case Standing::at_values:
      return text(
          "for these parameter values the system Jacobian of the structural analysis is singular; "
          "the structural index ",
          a.offsets.index(), " holds for almost all other values only");
    case Standing::on_solutions:
      if (a.solutions && a.solutions->points > 0 && a.solutions->dependent.size() > 1)
        return text(
            "the system Jacobian of the structural analysis has full rank in general, but where the "
            "equations "
            "hold ",
            equation_list(m, a.solutions->dependent),
            " depend on each other: one of them says nothing "
            "that the others do not say, as a redundant constraint does, and something else (a multiplier) "
            "is "
            "left open. Leave one of them out");
      return text(
          "the system Jacobian of the structural analysis has full rank in general, but is singular "
          "where the equations hold: the structural index ",
          a.offsets.index(),
          " would be wrong. Is there an equation whose gradient vanishes where it holds, as that of C² "
          "= 0 does? Write C = 0");
    case Standing::regular:
      break;
  }
  return "";
}

Analysis require_regular(const Model& m) {
  Analysis a = analyse(m);
  if (!a.regular) throw Failure("no index is given: " + why_not_regular(m, a));
  return a;
}

/// Parts that consist of parameters with values, and are zero there up to the rounding of these values:
/// cos(a) for a = π/2, read as a double.
static Substitution vanishing_parts(std::span<const Expr> expressions, const ParameterValues& values) {
  std::unordered_map<Expr, double> here, moved;
  for (const auto& [p, value] : values) {
    const double v = pendula::evaluate({&value, 1}, {})[0];
    here[p] = v;
    moved[p] = exact_value(value) ? v : v * (1 + 4e-16);
  }
  std::unordered_map<Expr, char> known;
  std::vector<Expr> parts;
  for (Expr e : topological(expressions)) {
    bool all = e.is_constant() || values.count(e) > 0 ||
               (e.is_symbol() && symbol_of(e).kind == pendula::Kind::constant);
    if (!all && !e.is_symbol() && e.op() != Op::call) {
      const auto operands = e.operands();
      all = std::all_of(operands.begin(), operands.end(), [&](Expr x) { return known[x]; });
      if (all) parts.push_back(e);
    }
    known[e] = all;
  }
  const auto at = pendula::evaluate(parts, here), near = pendula::evaluate(parts, moved);
  Substitution zero;
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (std::fabs(at[k]) <= 10 * std::fabs(at[k] - near[k])) zero[parts[k]] = Expr(0);
  return zero;
}

std::vector<Expr> at_values(std::span<const Expr> expressions, const ParameterValues& values) {
  const Substitution put(values.begin(), values.end());
  const bool rational = std::all_of(values.begin(), values.end(),
                                    [](const auto& v) { return exact_value(v.second) != nullptr; });
  if (rational) return substitute(expressions, put);
  return substitute(substitute(expressions, vanishing_parts(expressions, values)), put);
}

std::vector<Expr> residuals_at_values(const Model& m) { return at_values(m.residuals, m.values); }

}  // namespace pendula::dae
