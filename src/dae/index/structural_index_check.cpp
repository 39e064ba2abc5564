#include "dae/index/structural_index_check.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "dae/index/array_index.hpp"
#include "dae/index/open_direction.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/rank/stable_values.hpp"
#include "dae/structure/blocks.hpp"
#include "dae/structure/signature.hpp"

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

namespace {

/// Equations with all of their unknowns.
struct ClosedPart {
  std::vector<Expr> residuals;
  std::vector<Variable> variables;
};

/// Each block of the equations with those that it depends on, small ones first. Left out: parts of more than
/// `largest` equations.
std::vector<Part> closed_parts(const Pattern& pattern, int unknowns, std::size_t largest) {
  const std::vector<Part> blocks = dulmage_mendelsohn(pattern, unknowns).square;
  std::vector<int> block_of(static_cast<std::size_t>(unknowns), -1);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (int column : blocks[b].columns) block_of[column] = static_cast<int>(b);
  std::vector<Part> parts;
  std::vector<std::size_t> taken(blocks.size(), blocks.size());  // the block for which it was taken last
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    Part part;
    std::vector<std::size_t> open{b};
    taken[b] = b;
    while (!open.empty() && part.rows.size() <= largest) {
      const Part& next = blocks[open.back()];
      open.pop_back();
      part.rows.insert(part.rows.end(), next.rows.begin(), next.rows.end());
      part.columns.insert(part.columns.end(), next.columns.begin(), next.columns.end());
      for (int row : next.rows)
        for (int column : pattern[row]) {
          if (block_of[column] < 0) continue;
          const auto before = static_cast<std::size_t>(block_of[column]);
          if (taken[before] != b) open.push_back(before);
          taken[before] = b;
        }
    }
    if (open.empty() && part.rows.size() <= largest) parts.push_back(std::move(part));
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.rows.size() < b.rows.size(); });
  return parts;
}

/// The part of a model by its equations, with the orders of its unknowns there.
ClosedPart part_of(const Model& m, const std::vector<Expr>& residuals, const Part& part) {
  ClosedPart closed;
  for (int row : part.rows) closed.residuals.push_back(residuals[row]);
  std::unordered_map<Expr, int> order;
  for (Expr leaf : leaves(closed.residuals)) {
    int& highest = order[symbol_of(leaf).base];
    highest = std::max(highest, symbol_of(leaf).order);
  }
  for (int column : part.columns) {
    const Expr leaf = m.variables[column].leaf;
    closed.variables.push_back({leaf, order[leaf]});
  }
  return closed;
}

/// Of points_beyond(), of these equations; nothing where F_k has too many columns.
std::optional<int> points_beyond(const ClosedPart& part, int k) {
  constexpr std::size_t most_columns = 620;  // singular values cost O(n³)
  constexpr std::size_t many = 300;          // columns above which two points are enough
  DerivativeArray array(part.residuals, part.variables);
  for (int i = 0; i < k; ++i) array.extend();
  if (array.columns().size() > most_columns) return {};
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

DirectionCount directions_at(const std::vector<Expr>& residuals, const Model& m, int k) {
  constexpr std::size_t most_nodes = 100'000;  // of the residuals; a derivative has some times as many
  if (topological(residuals).size() > most_nodes) return {};
  DerivativeArray array(residuals, m.variables);
  for (int i = 0; i < k; ++i) array.extend();
  return count_directions(array, 2);
}

}  // namespace

int points_beyond(const Model& m, int k) {
  const std::vector<Expr> residuals = without_calls(residuals_at_values(m));
  if (const auto points = points_beyond(ClosedPart{residuals, m.variables}, k)) return *points;
  constexpr std::size_t largest = 150;  // equations; F_1 has four columns for each
  constexpr std::size_t most = 1000;    // equations of all parts together, for some 0.1 s
  std::size_t looked_at = 0;
  for (const Part& part : closed_parts(incidence(m), static_cast<int>(m.variables.size()), largest)) {
    looked_at += part.rows.size();
    if (looked_at > most) break;
    if (const int points = points_beyond(part_of(m, residuals, part), k).value_or(0); points > 1)
      return points;
  }
  return directions_at(residuals, m, k).open;
}

int points_determined(const Model& m, int k) {
  return directions_at(without_calls(residuals_at_values(m)), m, k).determined;
}

}  // namespace pendula::dae
