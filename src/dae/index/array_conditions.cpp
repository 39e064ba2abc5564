#include "dae/index/array_conditions.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "expr/normal/normal.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {

namespace {

std::string row_label(const Model& m, const DerivativeArray& array, int row) {
  const auto equations = static_cast<int>(array.equations());
  return m.label(static_cast<std::size_t>(row % equations)) + primes(row / equations);
}

/// ∂(row)/∂y as rationals; empty if an entry is not rational.
std::optional<TrackedRow> constant_row(const DerivativeArray& array, int row, const std::vector<Expr>& y) {
  TrackedRow tracked;
  tracked.combination[row] = 1;
  for (const Entry& e : sparse_jacobian({&array.rows()[row], 1}, y)) {
    const Expr value = simplify(e.value);
    const mpq_class* q = exact_value(value);
    if (!q) return {};
    if (*q != 0) tracked.entries[e.column] = *q;
  }
  return tracked;
}

}  // namespace

Expr with_leading_sign(Expr residual, const std::vector<Expr>& states) {
  for (Expr x : states) {
    const Expr slope = partial(residual, x);
    if (slope.is_zero()) continue;
    const Expr s = is_short(slope) ? simplify(slope) : slope;  // a number is short
    return s.is_constant() && constant_value(s) < 0 ? simplify(-residual) : residual;
  }
  return residual;
}

std::vector<ArrayCondition> explicit_conditions(
    const Model& model, const DerivativeArray& array, int orders,
    const std::function<bool(const std::vector<Expr>& found)>& independent) {
  std::vector<Expr> y = array.first();
  y.insert(y.end(), array.higher().begin(), array.higher().end());
  Substitution without_y;
  for (Expr leaf : y) without_y[leaf] = Expr(0);
  TrackedElimination elimination;
  std::vector<ArrayCondition> conditions;
  std::vector<Expr> found;
  const auto equations = static_cast<int>(array.equations());
  for (int row = 0; row < (orders + 1) * equations; ++row) {
    auto tracked = constant_row(array, row, y);
    if (!tracked) continue;
    TrackedRow left = elimination.add(std::move(*tracked));
    if (!left.entries.empty()) continue;
    make_coprime(left.combination);
    Expr sum = 0;
    for (const auto& [i, value] : left.combination)
      sum += Expr(value) * substitute(array.rows()[i], without_y);
    const Expr residual = with_leading_sign(simplify(sum), array.states());
    if (residual.is_constant()) continue;
    found.push_back(residual);
    if (!independent(found)) {
      found.pop_back();
      continue;
    }
    const int derivative = left.combination.rbegin()->first / equations;
    conditions.push_back({residual, derivative, combination_text(left.combination, [&](int i) {
                            return row_label(model, array, i);
                          })});
  }
  return conditions;
}

}  // namespace pendula::dae
