#include "dae/analysis/analysis.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/unsolvable.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/points/consistent_point_rank.hpp"
#include "dae/rank/rank.hpp"
#include "dae/structure/balance.hpp"
#include "dae/structure/differentiation.hpp"
#include "dae/structure/signature.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

/// Has J full rank at the parameter values of the model? The values are rationals or doubles, so the rank
/// modulo a prime is exact.
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
  } catch (const Error&) {  // a division by zero: no statement at these values
    return false;
  }
  std::erase_if(there, [](const Entry& e) { return e.value.is_zero(); });
  const auto n = static_cast<int>(m.variables.size());
  return modular_rank(there, n, n).rank == n;
}

/// Ranks of J at consistent points; empty if they cannot differ or are too expensive.
std::optional<ConsistentPointRanks> ranks_on_solutions(const Model& m, const Analysis& a) {
  if (!m.form.empty() || !m.invariants.empty() || m.variables.size() > ConsistentPointRank::affordable)
    return {};
  static ModelCache<std::optional<ConsistentPointRanks>> cache(cached_models);
  const ModelKey key = key_of(m);
  if (const auto* known = cache.find(key)) return *known;
  const Substitution values(m.values.begin(), m.values.end());
  std::vector<Entry> jacobian = a.jacobian;
  for (Entry& e : jacobian) e.value = substitute(e.value, values);
  const ConsistentPointRank there(residuals_at_values(m), unknowns_of(m), a.offsets, std::move(jacobian));
  return cache.insert(key, there.applies() ? std::optional(there.ranks()) : std::nullopt);
}

JacobianStatus jacobian_status_of(const Model& m, Analysis& a) {
  const auto n = static_cast<int>(m.variables.size());
  if (a.rank.rank < n) return JacobianStatus::identically;
  if (!regular_at_values(m, a)) return JacobianStatus::at_values;
  a.solutions = ranks_on_solutions(m, a);
  return a.solutions && a.solutions->always_below(n) ? JacobianStatus::on_solutions : JacobianStatus::regular;
}

}  // namespace

/// Models x_j⁽ᵏ⁾ = f with many unknowns, which have index 0 by their form. Only the diagonal of Σ is stored;
/// the other orders, dense where f solves a linear system, are below k.
static Analysis of_large_ode(const Model& m) {
  Analysis a;
  std::unordered_map<Expr, int> number;
  const auto n = m.variables.size();
  for (std::size_t j = 0; j < n; ++j) number[m.variables[j].leaf] = static_cast<int>(j);
  a.sigma.resize(n);
  a.offsets.c.assign(n, 0);
  a.offsets.d.resize(n);
  a.offsets.equation_of.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto [block, row] = m.origin[i];
    const int j = number.at(symbol_of(m.blocks[block].lhs[row]).base), order = m.variables[j].order;
    a.sigma[i] = {{j, order}};
    a.offsets.d[j] = order;
    a.offsets.equation_of[j] = static_cast<int>(i);
    a.offsets.value += order;
    a.jacobian.push_back({static_cast<int>(i), j, Expr(1)});
  }
  a.rank.rank = static_cast<int>(n);
  a.jacobian_status = JacobianStatus::regular;
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
  a.jacobian = system_jacobian(m.residuals, unknowns_of(m), a.offsets, a.sigma);
  a.rank = generic_rank(a.jacobian, n, n, m.residuals);
  a.jacobian_status = jacobian_status_of(m, a);
  a.regular = a.jacobian_status == JacobianStatus::regular;
  if (!a.regular) return a;
  a.index = a.offsets.index();
  a.dof = a.offsets.value;
  a.dof -= static_cast<int>(m.invariants.size());
  return a;
}

/// The cached result; the size of an entry is its number of equations, which bounds the memory
/// for large models.
template <class Find>
static auto cached(const Model& m, Find find) {
  constexpr std::size_t equations = 4000;  // of all models in the cache together
  static ModelCache<decltype(find())> cache(equations);
  const ModelKey key = key_of(m);
  if (const auto* known = cache.find(key)) return *known;
  auto found = find();
  return cache.insert(key, std::move(found), m.residuals.size());
}

Analysis analyse(const Model& m) {
  if (m.residuals.size() != m.variables.size()) throw Error(imbalance(m));
  return cached(m, [&] { return analysed(m); });
}

std::vector<Constraint> hidden_constraints_by_offsets(const Model& m, const Analysis& a) {
  if (!a.regular) return {};
  if (a.index <= 1 && a.offsets.value == static_cast<int>(m.states().size())) return m.invariants;
  return cached(m, [&] {
    std::vector<Constraint> list = m.invariants;
    auto more = differentiate(m, a.offsets).constraints;
    list.insert(list.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
    return list;
  });
}

std::string why_not_regular(const Model& m, const Analysis& a) {
  const auto n = m.variables.size();
  if (a.jacobian_status != JacobianStatus::unmatched)
    if (const std::string why = why_unsolvable(m); !why.empty()) return why;
  switch (a.jacobian_status) {
    case JacobianStatus::unmatched:
      return imbalance(m);
    case JacobianStatus::identically:
      return text("the system Jacobian of the structural analysis is singular (rank ", a.rank.rank, " of ", n,
                  "): the structural index ", a.offsets.index(), " is not valid");
    case JacobianStatus::at_values:
      return text(
          "for these parameter values the system Jacobian of the structural "
          "analysis is singular; the structural index ",
          a.offsets.index(), " holds for almost all other values only");
    case JacobianStatus::on_solutions:
      return text(
          "the system Jacobian of the structural analysis has full rank in general, "
          "but is singular where the equations hold",
          a.solutions && a.solutions->points > 0 && a.solutions->dependent.size() > 1
              ? text(" (the rows of ", equation_list(m, a.solutions->dependent), " depend on each other)")
              : "",
          ": the structural index ", a.offsets.index(), " is not valid",
          a.solutions && a.solutions->slow > 0 && a.solutions->points == 0
              ? ". At the points found the gradient of an equation vanishes, as that of C² = 0 does (write C = 0), "
                "or gradients depend on each other, as where two circles touch"
              : "");
    case JacobianStatus::regular:
      break;
  }
  return "";
}

Analysis require_regular(const Model& m) {
  Analysis a = analyse(m);
  const bool array_serves =
      a.jacobian_status == JacobianStatus::on_solutions && a.solutions && a.solutions->points > 0;
  if (!a.regular)
    throw Failure(text("the structural analysis fails: ", why_not_regular(m, a),
                       array_serves ? "; reduce \"array\" does not need it" : ""));
  return a;
}

}  // namespace pendula::dae
