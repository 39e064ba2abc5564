#include "dae/analysis.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/differentiation.hpp"
#include "dae/rank.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

std::string names_of(const std::vector<Expr>& list) {
  std::vector<std::string> names;
  for (Expr e : list) names.push_back(to_text(e));
  return join(names, ", ");
}

/// J_ij = ∂F_i/∂x_j^(d_j - c_i); equal to ∂F_i^(c_i)/∂x_j^(d_j) by Griewank's lemma (Pryce 2001, eq. (3.2)).
std::vector<Entry> system_jacobian(const Model& m, const Offsets& o, const Signature& sigma) {
  std::vector<Entry> J;
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    std::vector<Expr> x;
    std::vector<int> where;
    for (const SignatureEntry& e : sigma[i])
      if (o.d[e.variable] - o.c[i] == e.order)
        x.push_back(derivative_leaf(m.variables[e.variable].leaf, e.order)), where.push_back(e.variable);
    const auto row = gradient(m.residuals[i], x);
    for (std::size_t k = 0; k < row.size(); ++k)
      if (!row[k].is_zero()) J.push_back({static_cast<int>(i), where[k], row[k]});
  }
  return J;
}

}  // namespace

Signature signature(const Model& m) {
  std::unordered_map<Expr, int> number;
  for (std::size_t j = 0; j < m.variables.size(); ++j) number[m.variables[j].leaf] = static_cast<int>(j);
  Signature sigma;
  for (Expr r : m.residuals) {
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

Analysis analyse(const Model& m) {
  if (m.residuals.size() != m.variables.size()) {
    std::vector<Expr> unknowns;
    for (const Variable& v : m.variables) unknowns.push_back(v.leaf);
    throw Error(text("the model has ", m.residuals.size(), " equations for ", m.variables.size(),
                     " unknowns (", names_of(unknowns),
                     "): ", m.residuals.size() < m.variables.size() ? "add equations" : "remove equations"));
  }
  Analysis a;
  const auto n = static_cast<int>(m.variables.size());
  a.sigma = signature(m);
  a.offsets = offsets(a.sigma, n);
  if (!a.offsets.unmatched.empty()) return a;
  a.jacobian = system_jacobian(m, a.offsets, a.sigma);
  a.rank = generic_rank(a.jacobian, n, n);
  a.regular = a.rank.rank == n;
  if (!a.regular) return a;
  a.index = a.offsets.index();
  a.dof = a.offsets.value;
  if (a.index > 1 || a.offsets.value < static_cast<int>(m.states().size())) {
    a.constraints = differentiate(m, a.offsets).constraints;
  }
  a.constraints.insert(a.constraints.begin(), m.invariants.begin(), m.invariants.end());
  a.dof -= static_cast<int>(m.invariants.size());
  return a;
}

Analysis require_regular(const Model& m) {
  Analysis a = analyse(m);
  if (!a.offsets.unmatched.empty()) {
    std::vector<std::string> rows;
    for (int i : a.offsets.unmatched)
      rows.push_back(m.label(static_cast<std::size_t>(i)) + " " +
                     m.equation_text(static_cast<std::size_t>(i)));
    throw Failure(
        text("the model is structurally singular: no unknown is left for equation ", join(rows, "; ")));
  }
  if (!a.regular)
    throw Failure(text("the system Jacobian of the structural analysis is singular (rank ", a.rank.rank,
                       " of ", m.variables.size(), "): the structural index ", a.offsets.index(),
                       " would be wrong, so no index is given"));
  return a;
}

}  // namespace pendula::dae
