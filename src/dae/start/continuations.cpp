#include "dae/start/continuations.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/search/golden_section.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/points/array_points.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/continuation_check.hpp"
#include "dae/start/numeric_arrays.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

// threshold of coefficients at a meeting point, whose time is known to some digits (the tests
// of starts pass from 1e-6 to 1e-4)
constexpr double vanishing = 1e-5;
constexpr double nearby = 2e-3;  // in units: distance of the states of a found point from the given one

/// Points of F_k = 0 near the given one. exact: the given point is the singular one to within rounding.
/// Otherwise the states are varied, since next to it every branch is regular and attracts nearby points.
std::vector<Vec> points_near(const NumericArray& numeric, Index states, const PointValues& point,
                             bool exact) {
  constexpr int attempts = 32;  // half of them keep all given values
  // Units by which states are varied are within ±2 of these: close to a branch, and up to half of `nearby`.
  constexpr double slightly = 1e-7, clearly = nearby / 4;
  auto known = numeric.known(0);
  for (auto& [leaf, value] : known) {
    const auto given = point.find(leaf);
    if (given == point.end()) return {};
    value = given->second;
  }
  std::vector<Vec> found;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    Vec w(static_cast<Index>(numeric.columns().size()));
    for (Index j = 0; j < w.size(); ++j) {
      const auto given = point.find(numeric.columns()[j]);
      const bool keep = given != point.end() && (j < states || attempt % 2 == 0);
      const double drawn =
          4 * std::fmod((attempt + 1) * golden_fraction * static_cast<double>(j + 1), 1.0) - 2;
      w[j] = keep ? given->second : drawn * numeric.unit()[j];
      if (keep && j < states && !exact)
        w[j] += (attempt % 4 < 2 ? slightly : clearly) * drawn * numeric.unit()[j];
    }
    const auto at = numeric.project(w, known, 0, exact ? vanishing : 0);
    if (!at) continue;
    const Vec moved = (at->w - w).head(states).cwiseAbs();
    const Vec size = numeric.unit().head(states) + w.head(states).cwiseAbs();
    if ((moved.array() <= nearby * size.array()).all()) found.push_back(at->w);
  }
  return found;
}

/// Values of some unknowns, shared by several points.
struct Cluster {
  Vec values;
  Vec point;  ///< the complete first point
  int count = 1;
};

std::vector<Cluster> clusters(const std::vector<Vec>& points, const std::vector<Index>& columns,
                              const Vec& unit) {
  std::vector<Cluster> list;
  for (const Vec& w : points) {
    const Vec values = w(columns), size = unit(columns);
    const auto near = std::find_if(list.begin(), list.end(), [&](const Cluster& c) {
      return ((values - c.values).array().abs() <= same_derivative * (size + values.cwiseAbs()).array())
          .all();
    });
    if (near == list.end())
      list.push_back({values, w});
    else
      ++near->count;
  }
  return list;
}

/// The derivatives in which a cluster differs from any other.
std::vector<Expr> differing(const Cluster& c, const std::vector<Cluster>& all,
                            const std::vector<Expr>& leaves, const Vec& size) {
  std::vector<Expr> list;
  for (Index j = 0; j < c.values.size(); ++j) {
    if (std::none_of(all.begin(), all.end(), [&](const Cluster& other) {
          return std::fabs(other.values[j] - c.values[j]) >
                 same_derivative * (size[j] + std::fabs(c.values[j]));
        }))
      continue;
    list.push_back(leaves[j]);
  }
  return list;
}

/// The derivatives of one order in the array, with their columns.
struct Order {
  std::vector<Index> columns;
  std::vector<Expr> leaves;
};

Order of_order(const std::vector<Expr>& states, const std::vector<Expr>& all, int order) {
  Order found;
  for (Expr state : states) {
    const auto at = std::find(all.begin(), all.end(), derivative_leaf(state, order));
    if (at == all.end() || std::find(found.leaves.begin(), found.leaves.end(), *at) != found.leaves.end())
      continue;
    found.columns.push_back(at - all.begin());
    found.leaves.push_back(*at);
  }
  return found;
}

/// The states are taken from the given point, since the search has moved them slightly.
std::vector<Continuation> continuations_of(const std::vector<Cluster>& found, const Order& order,
                                           const ContinuationCheck& check, const PointValues& point,
                                           std::size_t states) {
  const auto& all = check.numeric().columns();
  const Vec size = check.numeric().unit()(order.columns);
  std::vector<Continuation> continuations;
  for (const Cluster& c : found) {
    Continuation continuation{"", point, {}, ""};
    for (std::size_t j = states; j < all.size(); ++j) continuation.values[all[j]] = c.point[j];
    name_by(continuation, differing(c, found, order.leaves, size), check);
    continuations.push_back(std::move(continuation));
  }
  std::sort(continuations.begin(), continuations.end(),
            [](const Continuation& a, const Continuation& b) { return a.text < b.text; });
  return continuations;
}

/// A solution of F_k = 0 near given values, with the columns that it leaves open.
struct SolvedArray {
  Vec w;
  std::vector<char> open;
};

/// The first `held` columns keep their values; the first `states` count as known in the decision
/// what is open.
std::optional<SolvedArray> solved_near(const NumericArray& numeric, Index held, Index states,
                                       const PointValues& values, double negligible) {
  auto known = numeric.known(0);
  for (auto& [leaf, value] : known) {
    const auto given = values.find(leaf);
    if (given == values.end()) return {};
    value = given->second;
  }
  const auto& columns = numeric.columns();
  Vec w = Vec::Zero(static_cast<Index>(columns.size()));
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (const auto given = values.find(columns[j]); given != values.end()) w[j] = given->second;
  const auto at = numeric.project(w, known, held, negligible);
  if (!at) return {};
  const Mat J = numeric.jacobian(at->w, known).unaryExpr([&](double v) {
    return std::fabs(v) <= negligible ? 0.0 : v;
  });
  const Mat N = null_space(equilibrated(J.rightCols(J.cols() - states)));
  SolvedArray solved{at->w, std::vector<char>(columns.size(), 0)};
  for (Index j = 0; j < N.rows() && N.cols() > 0; ++j)
    solved.open[j + states] = N.row(j).norm() > visible_in_null_vector;
  return solved;
}

/// The order up to which, at most k, all derivatives of all unknowns are determined.
int determined_orders(const std::vector<Expr>& states, const std::vector<Expr>& columns,
                      const SolvedArray& solved, int k) {
  for (int order = 1; order <= k; ++order) {
    const Order derivatives = of_order(states, columns, order);
    const auto& list = derivatives.columns;
    if (list.empty() || std::any_of(list.begin(), list.end(), [&](Index j) { return solved.open[j] != 0; }))
      return order - 1;
  }
  return k;
}

}  // namespace

std::vector<Continuation> continuations_at(const Model& m, const PointValues& point) {
  constexpr int most_derivatives = 4;               // a factorisation of all of them per attempt
  constexpr std::size_t affordable = 12, most = 4;  // unknowns; continuations
  if (m.variables.size() > affordable || !m.inputs.empty() || m.residuals.size() != m.variables.size())
    return {};
  const auto arrays = numeric_arrays(m);
  const std::vector<Expr>& states = arrays->states();
  std::vector<Continuation> only;
  for (const bool exact : {true, false})
    for (int k = 1; k <= most_derivatives; ++k) {
      const NumericArray& numeric = arrays->of_order(k);
      const ContinuationCheck check(m, numeric);
      const std::vector<Vec> points = points_near(numeric, static_cast<Index>(states.size()), point, exact);
      for (int order = 1; order <= k && !points.empty(); ++order) {
        const Order derivatives = of_order(states, numeric.columns(), order);
        std::vector<Cluster> found = clusters(points, derivatives.columns, numeric.unit());
        if (found.size() == 1) {
          if (order == 1) only = continuations_of(found, derivatives, check, point, states.size());
          std::erase_if(only,
                        [&](const Continuation& continuation) { return !check.exists_along(continuation); });
          continue;
        }
        only.clear();
        const auto alone = std::erase_if(found, [](const Cluster& c) { return c.count == 1; });
        const bool clear = found.size() >= 2 && found.size() <= most && 3 * alone <= points.size();
        if (!clear) break;
        auto continuations = continuations_of(found, derivatives, check, point, states.size());
        std::erase_if(continuations, [&](const Continuation& continuation) {
          return !check.holds(continuation) || !check.exists_along(continuation);
        });
        if (continuations.size() == 1) name_by(continuations[0], undetermined(m, point), check);
        if (!continuations.empty()) return continuations;
        break;
      }
    }
  for (Continuation& continuation : only)
    name_by(continuation, undetermined(m, point), ContinuationCheck(m, arrays->of_order(1)));
  return only;
}

std::string continuations_text(const std::vector<Continuation>& continuations) {
  std::vector<std::string> words;
  for (const Continuation& continuation : continuations) words.push_back(continuation.text);
  return join(words, " or ");
}

std::string choices_text(const std::vector<Continuation>& continuations) {
  std::vector<std::string> words;
  for (const Continuation& continuation : continuations) words.push_back(continuation.choice);
  return join(words, " or ");
}

/// The derivatives that are determined by states and algebraic variables even at meeting points: x′ = f.
static std::unordered_set<Expr> always_determined(const Model& m) {
  std::unordered_set<Expr> slopes;
  for (const Solved& row : solved_rows(m))
    if (partial(m.residuals[row.residual], row.derivative).is_constant()) slopes.insert(row.derivative);
  return slopes;
}

std::string cannot_choose(const Model& m, Expr leaf, double value) {
  const Expr own = resolve(m, leaf);
  const auto slopes = always_determined(m);
  std::unordered_map<Expr, int> orders;
  for (const Variable& v : m.variables) orders[v.leaf] = v.order;
  bool is_variable = false, may_differ = false;
  for (Expr inside : leaves({&own, 1})) {
    const Symbol& s = symbol_of(inside);
    const auto order = orders.find(s.base);
    if (order == orders.end()) continue;
    is_variable = true;
    may_differ = may_differ || (s.order >= std::max(order->second, 1) && !slopes.count(inside));
  }
  if (may_differ) return "";
  std::vector<std::string> keys;
  for (const Variable& v : m.variables)
    if (const Expr slope = derivative_leaf(v.leaf, std::max(v.order, 1)); !slopes.count(slope))
      keys.push_back(text("{ ", key_text(slope), " = 1 }"));
  constexpr std::size_t most = 3;  // shown as examples
  if (keys.size() > most) keys.resize(most);
  const std::string why = text("branch = { ", key_text(leaf), " = ", rounded(value), " }: ",
                               is_variable ? "solutions that meet have the same " + to_text(leaf)
                                           : to_text(leaf) + " is no unknown of the model");
  if (keys.empty()) return text(why, ": its equations give every derivative, leave branch out");
  return text(why,
              "; they differ in a derivative: write branch = \"smooth\", or choose by its value, branch = ",
              join(keys, " or "));
}

std::optional<double> meeting_time(const Model& m, const ContinuationExpansion& continuation,
                                   const PointValues& others, double to) {
  constexpr int samples = 64, sections = 80;
  constexpr double vanished = 1e-5;  // relative to the largest
  const std::vector<Entry> entries = top_jacobian(m);
  std::vector<Expr> slopes;
  for (const Entry& e : entries) slopes.push_back(e.value);
  const auto n = static_cast<Index>(m.variables.size());
  int order = 1;  // highest order of derivative in the equations
  for (const Variable& v : m.variables) order = std::max(order, v.order);
  PointValues values = others;
  const auto size = [&](double t) {
    for (const auto& [leaf, value] : continuation.at(t, order)) values[leaf] = value;
    const auto numbers = pendula::evaluate(slopes, values);
    Mat J = Mat::Zero(n, n);
    for (std::size_t k = 0; k < entries.size(); ++k) J(entries[k].row, entries[k].column) = numbers[k];
    return std::fabs(determinant_by_lu(J));
  };
  const double step = (to - continuation.t) / samples;
  int lowest = 0;
  double least = INFINITY, largest = 0;
  for (int i = 0; i <= samples; ++i) {
    const double here = size(continuation.t + i * step);
    if (here < least) lowest = i;
    least = std::min(least, here);
    largest = std::max(largest, here);
  }
  const double from = continuation.t + std::max(lowest - 1, 0) * step,
               until = continuation.t + std::min(lowest + 1, samples) * step;
  const double t = golden_section(size, from, until, sections).middle();
  if (!(size(t) <= vanished * largest)) return {};
  return t;
}

PointValues ContinuationExpansion::at(double time, int highest) const {
  PointValues values{{time_symbol(), time}};
  for (const auto& [leaf, d] : about(time).derivatives)
    for (std::size_t order = 0; order < d.size() && order <= static_cast<std::size_t>(highest); ++order)
      // an x′ that is a state itself has one term more than the derivative of x
      if (order == 0)
        values[leaf] = d[0];
      else
        values.try_emplace(derivative_leaf(leaf, static_cast<int>(order)), d[order]);
  return values;
}

ContinuationExpansion ContinuationExpansion::about(double time) const {
  ContinuationExpansion moved{time, derivatives};
  const double h = time - t;
  for (auto& [leaf, d] : moved.derivatives)
    for (std::size_t order = 0; order < d.size(); ++order) {
      double value = 0;
      for (std::size_t k = d.size(); k-- > order;)
        value = d[k] + value * h / static_cast<double>(k - order + 1);
      d[order] = value;
    }
  return moved;
}

double ContinuationExpansion::last_terms(std::size_t leaf, double distance) const {
  const auto& d = derivatives[leaf].second;
  double power = 1, before = 0, last = 0;
  for (std::size_t k = 1; k < d.size(); ++k) {
    power *= std::fabs(distance) / static_cast<double>(k);
    before = std::exchange(last, power * std::fabs(d[k]));
  }
  return std::max(before, last);
}

std::optional<ContinuationExpansion> expansion(const Model& m, const Continuation& continuation,
                                               bool at_meeting) {
  constexpr int most_derivatives = 7;
  constexpr std::size_t long_rows = 1'000;  // nodes
  const auto arrays = numeric_arrays(m);
  const auto states = static_cast<Index>(arrays->states().size());
  auto held = static_cast<Index>(m.states().size());
  const double negligible = at_meeting ? vanishing : 0;
  PointValues values = continuation.values;
  std::optional<ContinuationExpansion> best;
  int reached = 0;
  for (int k = 1; k <= most_derivatives && arrays->nodes(k) <= long_rows; ++k) {
    const NumericArray& numeric = arrays->of_order(k);
    auto solved = solved_near(numeric, held, states, values, negligible);
    if (!solved && k == 1) {  // hidden conditions: the states are known to some digits only
      held = 0;
      solved = solved_near(numeric, held, states, values, negligible);
    }
    if (!solved) continue;
    const auto& columns = numeric.columns();
    for (Index j = states; j < std::ssize(columns) && !at_meeting; ++j)  // starting values for the next order
      if (!solved->open[j]) values[columns[j]] = solved->w[j];
    const int order = determined_orders(arrays->states(), columns, *solved, k);
    if (order <= reached) continue;
    reached = order;
    best = ContinuationExpansion{continuation.values.at(time_symbol()), {}};
    for (Expr state : arrays->states()) {
      std::vector<double> d;
      for (int i = 0; i <= order; ++i) {
        const auto column = std::find(columns.begin(), columns.end(), derivative_leaf(state, i));
        if (column == columns.end()) break;
        d.push_back(solved->w[column - columns.begin()]);
      }
      best->derivatives.emplace_back(state, std::move(d));
    }
  }
  return best;
}

}  // namespace pendula::dae
