#include "dae/index/array_index.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/index/array_conditions.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/points/repeated_factors.hpp"
#include "dae/rank/modular.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr std::size_t most_nodes = 400'000;  // of F_k, for about a second of evaluations
constexpr std::size_t most_states = 400;     // for symbolic conditions, and for ranks at a given point
constexpr double near_enough = 1e3;          // size below which a slow point counts as singular
constexpr int max_seeds = 24;                // starting values tried for the points of one model

std::unordered_set<Expr> unknown_bases(const Model& m) {
  std::unordered_set<Expr> set;
  for (const Variable& v : m.variables) set.insert(v.leaf);
  return set;
}

bool mentions(Expr e, const std::unordered_set<Expr>& bases) {
  for (Expr leaf : leaves({&e, 1}))
    if (bases.count(symbol_of(leaf).base)) return true;
  return false;
}

/// The result of one determination of the index, of residuals in which parameters have no values.
struct Determination {
  ArrayVerdict verdict = ArrayVerdict::not_covered;
  int index = 0;  ///< where determined
  int states = 0, conditions = 0;
  int points = 0;
  std::optional<int> tried;  ///< the last k that was examined
  int y_rank = 0;
  std::optional<int> lowest, highest;  ///< first k with full rank at some point, at all points
  double gap = 0;
  bool exact = false, dependent = false;
  std::string why;
  std::unordered_map<Expr, double> point;  ///< one of the points used
  int dof() const { return states - conditions; }
};

/// Ranks modulo a prime; the columns of y and of higher derivatives follow those of x.
Determination determine_exactly(DerivativeArray array, const ArrayOptions& options) {
  Determination d;
  d.exact = true;
  d.states = static_cast<int>(array.states().size());
  const auto n = static_cast<int>(array.first().size());
  for (int k = 0; k <= d.states; ++k, array.extend()) {
    const auto columns = array.columns();
    if (static_cast<int>(columns.size()) > options.max_exact_columns) {
      d.why = text("F", subscript(k), " has ", columns.size(), " columns");
      return d;
    }
    d.tried = k;
    std::vector<Entry> all = sparse_jacobian(array.rows(), columns), y, higher;
    for (const Entry& e : all) {
      if (e.column >= d.states) y.push_back({e.row, e.column - d.states, e.value});
      if (e.column >= d.states + n) higher.push_back({e.row, e.column - d.states - n, e.value});
    }
    const auto rows = static_cast<int>(array.rows().size());
    const auto width = static_cast<int>(columns.size());
    const int rank_y = modular_rank(y, rows, width - d.states).rank;
    if (rank_y < n || rank_y != n + modular_rank(higher, rows, width - d.states - n).rank) continue;
    const int rank_all = modular_rank(all, rows, width).rank;
    d.dependent = rank_all < rows;
    d.verdict = ArrayVerdict::determined;
    d.index = k;
    d.y_rank = rank_y;
    d.conditions = rank_all - rank_y;
    return d;
  }
  d.verdict = ArrayVerdict::undetermined;
  return d;
}

/// A point that is continued when F_k grows, by its values.
struct TrackedPoint {
  int seed;
  std::unordered_map<Expr, double> values;
};

struct PointRanks {
  TrackedPoint point;
  ArrayRanks ranks;
};

/// The points found for one k.
struct PointSet {
  std::vector<PointRanks> found;
  int unclear = 0;  ///< points without a clear gap of singular values, for this k and those before
};

/// Finds up to options.points solutions of F_k = 0, first by continuing the tracked points, then from
/// new starting values.
void find_points(PointSet& set, const NumericArray& numeric, std::vector<TrackedPoint>& tracked,
                 int& next_seed, int points, int rows) {
  int full = 0;  // points at which the rows are independent, as in models with unique solutions
  set.found.clear();
  const auto visit = [&](TrackedPoint point) {
    const auto known = numeric.known(point.seed);
    const auto solution = numeric.project(numeric.start(point.seed, point.values), known, 0);
    if (!solution) return;
    for (std::size_t j = 0; j < numeric.columns().size(); ++j)
      point.values[numeric.columns()[j]] = solution->w[j];
    const ArrayRanks ranks = numeric.ranks(*solution, known);
    if (ranks.slow && solution->w.cwiseQuotient(numeric.unit()).cwiseAbs().maxCoeff() > near_enough)
      return;  // slow because it diverges
    full += ranks.all == rows && ranks.gap >= clear_gap;
    if (ranks.gap >= clear_gap || ranks.slow)
      set.found.push_back({std::move(point), ranks});
    else
      ++set.unclear;
  };
  for (TrackedPoint& w : tracked) visit(std::move(w));
  while ((static_cast<int>(set.found.size()) < points || full == 0) && next_seed < max_seeds)
    visit({next_seed++, {}});
  tracked.clear();
  for (const PointRanks& p : set.found)
    if (!p.ranks.slow) tracked.push_back(p.point);
}

/// The points that count: those with the largest rank. Branches meet where the equations lose rank.
std::vector<const PointRanks*> regular_points(const std::vector<PointRanks>& found) {
  int most = 0;
  for (const PointRanks& p : found)
    if (!p.ranks.slow) most = std::max(most, p.ranks.all);
  std::vector<const PointRanks*> regular;
  for (const PointRanks& p : found)
    if (!p.ranks.slow && p.ranks.all == most) regular.push_back(&p);
  return regular;
}

/// The verdict if no point of F_k = 0 is usable. A single slow point may be an accident, and is one if
/// smaller F had regular points.
Determination without_points(Determination d, const PointSet& points, int k) {
  const bool accident = points.found.size() < 2 || d.gap > 0;
  d.verdict = accident ? ArrayVerdict::not_covered : ArrayVerdict::singular;
  if (accident)
    d.why = text("no point with F", subscript(k), " = 0",
                 points.unclear ? " and a clear gap of singular values" : "", " was found from ", max_seeds,
                 " starting values");
  return d;
}

/// The smallest k' ≤ k for which F_k' determines x′ at these points as well. Points found with fewer
/// derivatives may all lie on a set where the equations lose rank (y² (3 y′ + y) = 0 at y = 0); points of F_k
/// = 0 with independent rows do not.
int least_order(const std::vector<const PointRanks*>& regular, int k, int n) {
  while (k > 0 && std::all_of(regular.begin(), regular.end(), [&](const PointRanks* p) {
           const ArrayRanks::OfPrefix& before = p->ranks.prefixes[k - 1];
           return before.y >= n && before.y == n + before.higher;
         }))
    --k;
  return k;
}

/// The verdict if the search ends with F_k; otherwise `d` is updated.
std::optional<Determination> judge(Determination& d, const PointSet& points, int k, int n, int rows) {
  const std::vector<const PointRanks*> regular = regular_points(points.found);
  d.points = static_cast<int>(points.found.size());
  if (regular.empty()) return without_points(d, points, k);
  int full = 0;
  double gap = INFINITY;
  for (const PointRanks* p : regular) {
    gap = std::min(gap, p->ranks.gap);
    if (p->ranks.y >= n && p->ranks.y == n + p->ranks.higher) ++full;
  }
  d.gap = d.gap > 0 ? std::min(d.gap, gap) : gap;
  if (full > 0 && !d.lowest) d.lowest = k;
  if (full < static_cast<int>(regular.size())) return {};
  const ArrayRanks& first = regular[0]->ranks;
  const bool constant = std::all_of(regular.begin(), regular.end(), [&](const PointRanks* p) {
    return p->ranks.y == first.y && p->ranks.all == first.all;
  });
  Determination end = d;
  const int least = first.all == rows && constant ? least_order(regular, k, n) : k;
  end.lowest = std::min(*end.lowest, least);
  end.highest = least;
  end.index = least;
  end.y_rank = first.y;
  end.conditions = first.all - first.y;
  end.dependent = first.all < rows;
  end.verdict = end.lowest == end.highest && constant ? ArrayVerdict::determined : ArrayVerdict::varying;
  if (end.dependent && end.verdict == ArrayVerdict::determined) {  // a rank was not determined correctly
    end.verdict = ArrayVerdict::not_covered;
    end.why = text("the ranks of F", subscript(k), " are not clear");
  }
  end.point = regular[0]->point.values;
  return end;
}

Determination determine_at_points(DerivativeArray array, const ArrayOptions& options) {
  Determination d;
  d.states = static_cast<int>(array.states().size());
  std::vector<TrackedPoint> tracked;
  for (const auto& [seed, values] : options.from) tracked.push_back({seed, values});
  PointSet points;
  int next_seed = 0;
  for (int k = 0; k <= options.max_order; ++k, array.extend()) {
    // F₀ alone decides little; do not search its points if F₁ will be too large
    const std::size_t columns = array.columns().size() + (k == 0 ? array.first().size() : 0);
    if (static_cast<int>(columns) > options.max_columns) {
      d.why = text("F", subscript(std::max(k, 1)), " has ", columns, " columns");
      return d;
    }
    if (topological(array.rows()).size() > most_nodes) {
      d.why = text("F", subscript(k), " has more than ", most_nodes, " operations");
      return d;
    }
    const auto rows = static_cast<int>(array.rows().size());
    find_points(points, NumericArray(array), tracked, next_seed, options.points, rows);
    d.tried = k;
    if (const auto end = judge(d, points, k, static_cast<int>(array.first().size()), rows)) return *end;
  }
  d.verdict = d.lowest ? ArrayVerdict::varying : ArrayVerdict::undetermined;
  if (!d.lowest && d.points < 2) {
    d.verdict = ArrayVerdict::not_covered;
    d.why = "ranks were clear at one point only";
  }
  return d;
}

Determination determine(const std::vector<Expr>& residuals, const Model& m, const ArrayOptions& options) {
  if (!options.numeric && exactly_linear(residuals, m))
    return determine_exactly(DerivativeArray(residuals, m.variables), options);
  std::unordered_set<Expr> bases;
  for (const Variable& v : m.variables) bases.insert(v.leaf);
  if (std::any_of(residuals.begin(), residuals.end(), [&](Expr row) { return is_power(row, bases); })) {
    Determination d;
    d.verdict = ArrayVerdict::singular;
    d.tried = 0;
    return d;
  }
  return determine_at_points(DerivativeArray(without_calls(residuals), m.variables), options);
}

std::string words(const Determination& d) {
  const std::string F = "F" + subscript(d.tried.value_or(0));
  switch (d.verdict) {
    case ArrayVerdict::determined:
      return text("index ", d.index, ", ", d.dof(), d.dof() == 1 ? " degree" : " degrees", " of freedom: ",
                  d.index == 0 ? "the equations as they stand determine"
                               : text("differentiated ", d.index, d.index == 1 ? " time" : " times",
                                      " they determine"),
                  " the derivatives of all unknowns",
                  d.dependent ? "; some of the differentiated equations depend on others" : "");
    case ArrayVerdict::varying:
      return !d.highest
                 ? text("the index depends on where the solution is: ", *d.lowest,
                        " at some points, more than ", *d.tried, " at others")
                 : text("the index or the number of conditions depends on where the solution is (index ",
                        *d.lowest, d.lowest == d.highest ? "" : text(" to ", *d.highest), ")");
    case ArrayVerdict::singular:
      return text("the Jacobian of ", F,
                  " = 0 loses rank on the solutions (as z³ = 0 does): no index by ranks exists there");
    case ArrayVerdict::undetermined:
      return text(
          "differentiated up to ", d.tried.value_or(0),
          " times the equations do not determine the derivatives of all unknowns",
          d.exact ? ": the model has no unique solution for any start, or its equations depend on each other"
                  : ": dependent equations, or an index above that");
    case ArrayVerdict::not_covered:
      return text("not decided: ", d.why);
  }
  return "";
}

/// Do the conditions found so far have full rank at a point of the solution?
auto independence(const Model& m, const DerivativeArray& array, const Determination& d) {
  const bool symbolic = d.exact || without_calls(m.residuals) != m.residuals;
  std::unordered_map<Expr, double> point = d.point;
  if (!symbolic) {
    for (const auto& [leaf, value] : NumericArray(array).known(0)) point.emplace(leaf, value);
    for (const auto& [p, value] : m.values) point[p] = pendula::evaluate({&value, 1}, {})[0];
  }
  return [symbolic, point, states = array.states()](const std::vector<Expr>& found) {
    const auto gradient = sparse_jacobian(found, states);
    const auto rows = static_cast<int>(found.size()), columns = static_cast<int>(states.size());
    if (symbolic) return modular_rank(gradient, rows, columns).rank == rows;
    std::vector<Expr> slopes;
    for (const Entry& e : gradient) slopes.push_back(e.value);
    Mat J = Mat::Zero(rows, columns);
    const auto values = pendula::evaluate(slopes, point);
    for (std::size_t k = 0; k < gradient.size(); ++k) J(gradient[k].row, gradient[k].column) = values[k];
    return J.allFinite() && rank_with_gap(J).rank == rows;
  };
}

/// The conditions in parameter symbols if that yields all of them, else at the parameter values.
std::vector<ArrayCondition> conditions_of(const Model& m, const std::vector<Expr>& given,
                                          const Determination& d) {
  if (d.conditions == 0 || static_cast<std::size_t>(d.states) > most_states) return {};
  const int orders = std::max(d.index - 1, 0);
  std::vector<ArrayCondition> best;
  for (const auto& residuals : {m.residuals, given}) {
    DerivativeArray array(residuals, m.variables);
    for (int k = 0; k < orders; ++k) array.extend();
    try {
      auto found = explicit_conditions(m, array, orders, independence(m, array, d));
      if (found.size() > best.size() || best.empty()) best = std::move(found);
    } catch (const UserFacing&) {  // a value that cannot be substituted or evaluated
    }
    if (static_cast<int>(best.size()) == d.conditions) break;
  }
  return best;
}

/// Checks a given point: x held, y solved for. Returns a description of the problem, or nothing.
std::string trouble_at(const Model& m, const std::vector<Expr>& residuals, const Determination& d,
                       const std::unordered_map<Expr, double>& at) {
  DerivativeArray array(without_calls(residuals), m.variables);
  for (int k = 0; k < d.index; ++k) array.extend();
  if (array.columns().size() > most_states) return "";
  const NumericArray numeric(array);
  auto known = numeric.known(0);
  for (auto& [leaf, value] : known)
    if (const auto it = at.find(leaf); it != at.end()) value = it->second;
  Vec w = Vec::Zero(static_cast<Index>(numeric.columns().size()));
  for (std::size_t j = 0; j < numeric.columns().size(); ++j) {
    const auto it = at.find(numeric.columns()[j]);
    if (it != at.end())
      w[j] = it->second;
    else if (j < array.states().size())
      return "";
  }
  const auto held = static_cast<Index>(array.states().size());
  const auto solution = numeric.project(w, known, held);
  const ArrayRanks ranks = numeric.ranks(solution.value_or(NumericArray::Solution{w, false}), known);
  const auto n = static_cast<int>(array.first().size());
  if (ranks.y != n + ranks.higher || ranks.y < n)
    return text("singular at this point: the derivatives of the unknowns are not determined there (rank ",
                ranks.y, " instead of ", d.y_rank, ")");
  if (ranks.y != d.y_rank)
    return text("singular at this point: the rank of the derivative array is ", ranks.y, " instead of ",
                d.y_rank);
  return "";
}

}  // namespace

bool exactly_linear(const std::vector<Expr>& residuals, const Model& m) {
  const auto bases = unknown_bases(m);
  std::vector<Expr> unknowns, coefficients;
  for (Expr leaf : leaves(residuals))
    if (bases.count(symbol_of(leaf).base)) unknowns.push_back(leaf);
  for (const Entry& e : sparse_jacobian(residuals, unknowns)) {
    if (!e.value.is_constant() && mentions(e.value, bases)) return false;
    coefficients.push_back(e.value);
  }
  return generic::decided_by_residues(coefficients);
}

ArrayResult derivative_array(const Model& m, const ArrayOptions& options) {
  const std::vector<Expr> given = residuals_at_values(m);
  const Determination d = determine(given, m, options);
  ArrayResult r;
  r.verdict = d.verdict;
  r.exact = d.exact;
  r.points = d.points;
  r.gap = d.gap;
  r.text = words(d);
  if (d.verdict == ArrayVerdict::determined) {
    r.index = d.index;
    r.dof = d.dof();
    r.conditions = d.conditions;
    if (options.conditions) r.constraints = conditions_of(m, given, d);
    if (given != m.residuals) {
      const Determination generic = determine(m.residuals, m, options);
      if (generic.verdict == ArrayVerdict::determined &&
          (generic.index != d.index || generic.dof() != d.dof())) {
        r.generic_index = generic.index;
        r.generic_dof = generic.dof();
        r.text += text("; for almost all other parameter values the index is ", generic.index, " with ",
                       generic.dof(), generic.dof() == 1 ? " degree" : " degrees", " of freedom");
      }
    }
    if (options.at)
      if (const std::string trouble = trouble_at(m, given, d, *options.at); !trouble.empty()) {
        r.verdict = ArrayVerdict::singular;
        r.text = trouble + "; elsewhere: " + r.text;
      }
  }
  r.covered = d.exact ? text("derivative array up to F", subscript(d.tried.value_or(0)),
                             ", ranks exact modulo 2⁶¹ - 1")
                      : text("derivative array up to F", subscript(d.tried.value_or(0)), ", ranks at ",
                             d.points, d.points == 1 ? " point" : " points",
                             " with F = 0, smallest gap of singular values ", rounded(d.gap, 2));
  if (options.conditions && d.verdict == ArrayVerdict::determined &&
      static_cast<int>(r.constraints.size()) < d.conditions)
    r.covered += text("; ", r.constraints.size(), " of ", d.conditions, " conditions written out");
  return r;
}

}  // namespace pendula::dae
