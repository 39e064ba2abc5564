#include "dae/index/structural_index_check.hpp"

#include <algorithm>

#include "dae/index/array_index.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/rank/stable_values.hpp"

namespace pendula::dae {
namespace {

constexpr int wanted = 3;  // points
constexpr int seeds = 8;   // starting values tried

/// The system Jacobian at a point.
Mat as_numbers(const std::vector<Entry>& jacobian, const StableValues& at, int n) {
  Mat J = Mat::Zero(n, n);
  for (std::size_t k = 0; k < jacobian.size(); ++k)
    if (!at.noise[k]) J(jacobian[k].row, jacobian[k].column) = at.value[k];
  return J;
}

}  // namespace

int points_of_agreement(const Model& m, const Analysis& a) {
  const auto n = static_cast<int>(m.variables.size());
  const int k = a.index - 1, most = *std::max_element(a.offsets.c.begin(), a.offsets.c.end());
  const std::vector<Expr> given = residuals_at_values(m);
  if (k < std::max(most, 0) || exactly_linear(given, m)) return 0;
  DerivativeArray array(without_calls(given), m.variables);
  for (int i = 0; i < k; ++i) array.extend();
  const NumericArray numeric(array);
  std::vector<Expr> slopes;
  for (const Entry& e : a.jacobian) slopes.push_back(e.value);
  slopes = without_calls(at_values(slopes, m.values));
  const auto first = static_cast<int>(array.first().size());
  int points = 0;
  for (int seed = 0; seed < seeds && points < wanted; ++seed) {
    const auto known = numeric.known(seed);
    const auto solution = numeric.project(numeric.start(seed), known, 0);
    if (!solution) continue;
    const ArrayRanks ranks = numeric.ranks(*solution, known);
    const bool open = ranks.y < first || ranks.y != first + ranks.higher;
    if (ranks.slow || !(ranks.gap >= clear_gap) || !open) return 0;
    const RankGap J = rank_with_gap(as_numbers(
        a.jacobian, evaluate_stable(slopes, numeric.columns(), solution->w, known, numeric.unit()), n));
    if (J.rank < n || !(J.gap >= clear_gap)) return 0;
    ++points;
  }
  return points == wanted ? points : 0;
}

int points_beyond(const Model& m, int k) {
  constexpr std::size_t most_columns = 620, many = 300;
  DerivativeArray array(without_calls(residuals_at_values(m)), m.variables);
  for (int i = 0; i < k; ++i) array.extend();
  if (array.columns().size() > most_columns) return 0;
  const NumericArray numeric(array);
  const auto first = static_cast<int>(array.first().size());
  const int enough = array.columns().size() > many ? 2 : wanted;
  int points = 0;
  for (int seed = 0; seed < seeds && points < enough; ++seed) {
    const auto known = numeric.known(seed);
    const auto solution = numeric.project(numeric.start(seed), known, 0);
    if (!solution || solution->slow) continue;
    const ArrayRanks ranks = numeric.ranks(*solution, known);
    if (!(ranks.gap >= clear_gap)) continue;
    if (ranks.y >= first && ranks.y == first + ranks.higher) return 0;
    ++points;
  }
  return points;
}

}  // namespace pendula::dae
