#include "dae/structure/signature.hpp"

#include <algorithm>
#include <unordered_map>

namespace pendula::dae {

std::vector<Expr> unknowns_of(const Model& m) {
  std::vector<Expr> list;
  for (const Variable& v : m.variables) list.push_back(v.leaf);
  return list;
}

std::vector<Entry> system_jacobian(const std::vector<Expr>& residuals, const std::vector<Expr>& variables,
                                   const Offsets& o, const Signature& sigma) {
  std::vector<Entry> J;
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    std::vector<Expr> leading;
    std::vector<int> where;
    for (const SignatureEntry& e : sigma[i])
      if (o.d[e.variable] - o.c[i] == e.order) {
        leading.push_back(derivative_leaf(variables[e.variable], e.order));
        where.push_back(e.variable);
      }
    const auto row = gradient(residuals[i], leading);
    for (std::size_t k = 0; k < row.size(); ++k)
      if (!row[k].is_zero()) J.push_back({static_cast<int>(i), where[k], row[k]});
  }
  return J;
}

Signature signature(const Model& m) { return signature(m.residuals, unknowns_of(m)); }

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

}  // namespace pendula::dae
