#include "dae/points/rank_on_zero_set.hpp"

#include "dae/points/array_points.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/rank/stable_values.hpp"

namespace pendula::dae {

ZeroSetRanks rank_on_zero_set(const std::vector<Expr>& r, const std::vector<Expr>& z) {
  constexpr int seeds = 12;  // starting values
  const auto n = static_cast<int>(z.size());
  const std::vector<Expr> rows = without_calls(r);
  const std::vector<Entry> jacobian = sparse_jacobian(rows, z);
  std::vector<Expr> slopes;
  for (const Entry& e : jacobian) slopes.push_back(e.value);
  const NumericArray numeric(rows, z);
  ZeroSetRanks result;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto known = numeric.known(seed);
    const auto at = numeric.project(numeric.start(seed), known, 0);
    if (!at) continue;
    bool full = !at->slow;
    if (full) {
      const auto [value, noise] = evaluate_stable(slopes, z, at->w, known);
      Mat J = Mat::Zero(n, n);
      for (std::size_t k = 0; k < jacobian.size(); ++k)
        if (!noise[k]) J(jacobian[k].row, jacobian[k].column) = value[k];
      if (!J.allFinite()) continue;
      full = rank_with_gap(J).rank == n;
    }
    ++(full ? result.regular : result.singular);
  }
  return result;
}

}  // namespace pendula::dae
