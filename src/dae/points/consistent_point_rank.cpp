#include "dae/points/consistent_point_rank.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_map>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/points/repeated_factors.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/rank/stable_values.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/taylor.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

// expressions that must not vanish are larger; starting values are near 1
constexpr double off_domain = 1e-6;
// bound on a point where an expression vanishes, to exclude limits at infinity
constexpr double near_enough = 1e3;
constexpr std::size_t longest_differentiated = 20000;  // operations of the differentiated equations

}  // namespace

ConsistentPointRank::ConsistentPointRank(const std::vector<Expr>& residuals, std::vector<Expr> variables,
                                         const Offsets& offsets, std::vector<Entry> jacobian,
                                         const std::vector<Expr>& nonzero)
    : size_(static_cast<int>(variables.size())),
      offsets_(offsets),
      variables_(std::move(variables)),
      jacobian_(std::move(jacobian)) {
  const std::unordered_set<Expr> bases(variables_.begin(), variables_.end());
  for (const Entry& e : jacobian_) slopes_.push_back(e.value);
  const std::vector<Expr> inside = leaves(slopes_);
  const bool varies = std::any_of(inside.begin(), inside.end(),
                                  [&](Expr leaf) { return bases.count(symbol_of(leaf).base) > 0; });
  std::unordered_map<Expr, int> order;
  for (Expr leaf : leaves(residuals)) {
    int& highest = order[symbol_of(leaf).base];
    highest = std::max(highest, symbol_of(leaf).order);
  }
  for (Expr v : variables_) orders_.push_back(order[v]);
  if (size_ > affordable || !varies) return;
  TaylorSeries series;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    for (int k = 0; k <= offsets.c[i]; ++k) {
      if (k == 0) as_written_.push_back(rows_.size());
      rows_.push_back(k == 0                                          ? residuals[i]
                      : prefers_series(residuals[i], rows_.back(), k) ? series.derivative(residuals[i], k)
                                                                      : total_derivative(rows_.back()));
      stages_.push_back(k - offsets_.c[i]);
    }
  if (topological(rows_).size() > longest_differentiated) return;
  applies_ = true;
  vanishes_twice_ =
      std::any_of(residuals.begin(), residuals.end(), [&](Expr row) { return is_power(row, bases); });
  const auto equations = static_cast<std::ptrdiff_t>(rows_.size());
  slopes_.insert(slopes_.end(), nonzero.begin(), nonzero.end());
  rows_.insert(rows_.end(), slopes_.begin(), slopes_.end());
  rows_ = without_calls(rows_);  // together, so that a function is the same in equations and entries
  slopes_.assign(rows_.begin() + equations, rows_.end());
  rows_.resize(static_cast<std::size_t>(equations));
}

namespace {

/// A starting point. Odd seeds give the unknowns very different sizes: where branches meet, each attracts
/// some of them.
Vec starting_point(const NumericArray& numeric, int seed) {
  Vec w = numeric.start(seed);
  if (seed % 2 == 0) return w;
  std::uniform_real_distribution<double> size(-1.7, 0.6);  // decades: 0.02 … 4
  constexpr double middle = -0.55;                         // of them: half of the unknowns are negative
  for (Index j = 0; j < w.size(); ++j) {
    std::mt19937_64 random(name_hash(numeric.columns()[j]) + static_cast<unsigned>(seed));
    w[j] = numeric.unit()[j] * std::copysign(std::pow(10, size(random)), size(random) - middle);
  }
  return w;
}

bool depends_on_any(const std::vector<Expr>& rows, Expr leaf) {
  const auto inside = leaves(rows);
  return std::find(inside.begin(), inside.end(), leaf) != inside.end();
}

std::vector<Expr> unknowns_in(std::vector<Expr> rows, const std::vector<Expr>& more,
                              const std::vector<Expr>& variables) {
  rows.insert(rows.end(), more.begin(), more.end());
  const std::unordered_set<Expr> bases(variables.begin(), variables.end());
  std::vector<Expr> found;
  for (Expr leaf : leaves(rows))
    if (bases.count(symbol_of(leaf).base)) found.push_back(leaf);
  return found;
}

}  // namespace

/// Puts as many unknowns first as there are free initial values, different ones for every seed. Held at their
/// starting values, they lead to branches on which they are free.
std::vector<Expr> ConsistentPointRank::with_held_first(std::vector<Expr> columns, int seed) const {
  std::unordered_map<Expr, int> leading;
  for (std::size_t j = 0; j < variables_.size(); ++j) leading[variables_[j]] = offsets_.d[j];
  const auto end = std::stable_partition(columns.begin(), columns.end(), [&](Expr leaf) {
    const Symbol& s = symbol_of(leaf);
    return s.order < leading[s.base];
  });
  const auto below = end - columns.begin();
  if (below > 0) std::rotate(columns.begin(), columns.begin() + seed / 4 % below, end);
  return columns;
}

/// The rows with a component in a left null vector.
static std::vector<int> dependent_rows(Mat J, int rank) {
  for (Index i = 0; i < J.rows(); ++i)
    if (const double size = J.row(i).norm(); size > 0) J.row(i) /= size;
  const Eigen::JacobiSVD<Mat> svd(J, Eigen::ComputeFullU);
  std::vector<int> rows;
  for (Index i = 0; i < J.rows(); ++i)
    if (svd.matrixU().row(i).tail(J.rows() - rank).norm() > visible_in_null_vector)
      rows.push_back(static_cast<int>(i));
  return rows;
}

std::optional<ConsistentPointRank::Point> ConsistentPointRank::point(int seed, const NumericArray& numeric,
                                                                     int held, double size) const {
  const std::vector<Expr>& columns = numeric.columns();
  const auto known = numeric.known(seed);
  Vec from = size * starting_point(numeric, seed);
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (std::find(variables_.begin(), variables_.end(), symbol_of(columns[j]).base) == variables_.end())
      from[j] = std::fabs(from[j]);
  const auto at = numeric.project(std::move(from), known, held);
  if (!at || (at->slow && at->w.cwiseQuotient(numeric.unit()).cwiseAbs().maxCoeff() >= near_enough))
    return {};
  auto [value, noise] = evaluate_stable(slopes_, columns, at->w, known, numeric.unit());
  const auto allowed = static_cast<std::ptrdiff_t>(jacobian_.size());
  if (std::any_of(value.begin() + allowed, value.end(), [](double x) { return std::fabs(x) < off_domain; }))
    return {};
  return Point{std::move(value), std::move(noise), leading_units(columns, numeric.unit()), at->slow};
}

/// The units of x_j^(d_j) for every column of the Jacobian.
Vec ConsistentPointRank::leading_units(const std::vector<Expr>& columns, const Vec& unit) const {
  Vec result = Vec::Ones(size_);
  for (std::size_t j = 0; j < variables_.size(); ++j) {
    const Expr leaf = derivative_leaf(variables_[j], offsets_.d[j]);
    const auto at = std::find(columns.begin(), columns.end(), leaf);
    if (at != columns.end()) result[j] = unit[at - columns.begin()];
  }
  return result;
}

/// Solves stage by stage, like Pryce (BIT 41(2), 2001, §3) for Taylor coefficients: F_i^(c_i + s) = 0 for the
/// x_j^(d_j + s), s = -max d … 0, with the results of earlier stages held. On all equations together
/// Gauss–Newton tends to points of low rank, where velocities are easier to satisfy: a parallelogram
/// collapses. A stage without a solution near 1 gets units of its own, since derivatives of order 20 are as
/// large as the lower ones make them.
std::optional<ConsistentPointRank::StagedValues> ConsistentPointRank::staged_values(
    int seed, const NumericArray& all) const {
  std::unordered_map<Expr, int> leading;
  for (std::size_t j = 0; j < variables_.size(); ++j) leading[variables_[j]] = offsets_.d[j];
  StagedValues result{all.known(seed), all.start(seed), all.unit(), false};
  auto known = result.known;
  for (int stage = -*std::max_element(offsets_.d.begin(), offsets_.d.end()); stage <= 0; ++stage) {
    std::vector<Expr> rows, unknowns;
    for (std::size_t k = 0; k < rows_.size(); ++k)
      if (stages_[k] == stage) rows.push_back(rows_[k]);
    std::vector<Index> place;
    for (std::size_t j = 0; j < all.columns().size(); ++j) {
      const Symbol& s = symbol_of(all.columns()[j]);
      if (s.order - leading[s.base] != stage) continue;
      unknowns.push_back(all.columns()[j]);
      place.push_back(static_cast<Index>(j));
    }
    if (unknowns.empty()) continue;
    if (!rows.empty()) {
      auto at = NumericArray(rows, unknowns).project(result.w(place), known, 0);
      if (!at) {
        const NumericArray sized(rows, unknowns, NumericArray::Units::far_from_one, &known);
        result.w(place) = result.w(place).cwiseQuotient(result.unit(place)).cwiseProduct(sized.unit()).eval();
        result.unit(place) = sized.unit();
        at = sized.project(result.w(place), known, 0);
      }
      if (!at) return {};
      result.w(place) = at->w;
      result.slow = result.slow || at->slow;
    }
    for (Index j : place) known[all.columns()[j]] = result.w[j];
  }
  const bool whole = std::all_of(all.columns().begin(), all.columns().end(),
                                 [&](Expr leaf) { return known.count(leaf) > 0; });
  return whole ? std::optional(std::move(result)) : std::nullopt;
}

std::optional<ConsistentPointRank::Point> ConsistentPointRank::staged_point(int seed,
                                                                            const NumericArray& all) const {
  const auto at = staged_values(seed, all);
  if (!at) return {};
  const std::vector<Expr>& columns = all.columns();
  auto [value, noise] = evaluate_stable(slopes_, columns, at->w, at->known, at->unit);
  const auto allowed = static_cast<std::ptrdiff_t>(jacobian_.size());
  if (std::any_of(value.begin() + allowed, value.end(), [](double x) { return std::fabs(x) < off_domain; }))
    return {};
  return Point{std::move(value), std::move(noise), leading_units(columns, at->unit), at->slow};
}

std::optional<std::unordered_map<Expr, double>> ConsistentPointRank::consistent_values(int seed) const {
  const std::vector<Expr> columns = unknowns_in(rows_, slopes_, variables_);
  const auto at = staged_values(seed, NumericArray(rows_, columns));
  if (!at || at->slow) return {};
  std::unordered_map<Expr, double> values = at->known;
  for (std::size_t j = 0; j < columns.size(); ++j) values[columns[j]] = at->w[j];
  return values;
}

bool ConsistentPointRank::proves_index(const Mat& J) const {
  const LowerIndexRows lower = lower_index_rows(offsets_, orders_);
  if (lower.asked == 0) return offsets_.index() == 0;
  const RankGap rest = rank_in_any_units(J(lower.rows, lower.other_columns));
  return rest.gap >= clear_gap && lower.cannot_determine(rest.rank);
}

ConsistentPointRanks ConsistentPointRank::ranks(int wanted, int seeds) const {
  ConsistentPointRanks result;
  if (vanishes_twice_) {
    result.slow = 2;
    return result;
  }
  const std::vector<Expr> columns = unknowns_in(rows_, slopes_, variables_);
  const NumericArray numeric(rows_, columns);
  // integrals that nothing else contains are free as well, but no unknowns here: W′ = …, without W
  const int held = std::min(offsets_.value, static_cast<int>(columns.size()));
  const int enough = std::max(wanted, size_ <= 12 ? 16 : 3);  // points before the rank is called deficient
  const auto take = [&](const Point& at) {
    Mat J = Mat::Zero(size_, size_);
    for (std::size_t k = 0; k < jacobian_.size(); ++k)
      if (!at.noise[k])
        J(jacobian_[k].row, jacobian_[k].column) = at.slopes[k] * at.unit[jacobian_[k].column];
    if (!J.allFinite()) return;
    const int rank = rank_in_any_units(J).rank;
    if (rank < size_ && (result.points == 0 || rank < result.least))
      result.dependent = dependent_rows(J, rank);
    result.most = std::max(result.most, rank);
    if (rank == size_ && proves_index(J)) ++result.index_proved;
    result.least = result.points++ ? std::min(result.least, rank) : rank;
  };
  constexpr int more = 6, high = 5;  // points; derivatives, as in StartLevels
  const auto take_staged = [&] {
    for (int seed = 0; seed < more && result.most < size_; ++seed)
      if (const auto at = staged_point(seed, numeric); at && !at->slow) take(*at);
  };
  const bool staged_first = *std::max_element(offsets_.c.begin(), offsets_.c.end()) >= high;
  if (staged_first) take_staged();  // derivatives of high order mislead Newton's method
  if (wanted == 1 && result.most == size_) return result;
  for (int seed = 0; seed < seeds && result.points < enough; ++seed) {
    const bool hold = seed % 4 == 1 && held > 0;
    const auto at = hold ? point(seed, numeric.with_columns(with_held_first(columns, seed)), held)
                         : point(seed, numeric, 0);
    if (!at) continue;
    if (at->slow)
      ++result.slow;
    else
      take(*at);
    if (wanted == 1 && result.most == size_ && result.points > result.slow) break;
  }
  if (!staged_first) take_staged();
  // Where the gradient of C³ vanishes, few iterations end early, and those end near a solution rather than
  // at one, where the rank differs.
  constexpr int few = 5;
  if (result.slow >= few * result.points) result = {.slow = result.slow};
  if (result.points + result.slow == 0) {
    const NumericArray all(rows_, with_given_ones(columns));
    for (int seed = 0; seed < seeds && result.points < enough; ++seed)
      for (const double size : {1.0, 30.0})
        if (const auto at = point(seed, all, 0, size); at && !at->slow) take(*at);
    if (result.most < size_) result = {};  // far out, where tanh rounds to 1, rank is lost to rounding
  }
  if (result.points == 0) result.slow = std::max(result.slow, points_of_one_equation());
  return result;
}

/// Adds time, inputs and parameters without a value to the unknowns: x² = u has no solution for u < 0.
std::vector<Expr> ConsistentPointRank::with_given_ones(std::vector<Expr> columns) const {
  const std::unordered_set<Expr> unknown(columns.begin(), columns.end());
  for (Expr leaf : leaves(rows_))
    if (!unknown.count(leaf) && symbol_of(leaf).kind != Kind::constant) columns.push_back(leaf);
  return columns;
}

/// The largest number of points on a single equation at which its gradient vanishes, if that is so at all
/// points found: C² = 0. All equations together may then have no point that Newton's method reaches.
int ConsistentPointRank::points_of_one_equation() const {
  constexpr int seeds = 6;  // starting values per equation
  int most = 0;
  for (std::size_t row : as_written_) {
    const NumericArray numeric({rows_[row]}, unknowns_in({rows_[row]}, {}, variables_));
    int slow = 0, regular = 0;
    for (int seed = 0; seed < seeds && regular == 0; ++seed)
      if (const auto at = numeric.project(numeric.start(seed), numeric.known(seed), 0))
        ++(at->slow ? slow : regular);
    if (regular == 0) most = std::max(most, slow);
  }
  return most;
}

bool ConsistentPointRank::reaches(Expr factor, int seeds) const {
  std::vector<Expr> rows = rows_;
  rows.push_back(without_calls({factor})[0]);
  std::vector<Expr> columns = unknowns_in(rows, {}, variables_);
  if (depends_on_any(rows, time_symbol())) columns.push_back(time_symbol());  // at any time
  const NumericArray numeric(rows, columns);
  for (int seed = 0; seed < seeds; ++seed) {
    const auto at = numeric.project(starting_point(numeric, seed), numeric.known(seed), 0);
    if (at && at->w.cwiseQuotient(numeric.unit()).cwiseAbs().maxCoeff() < near_enough) return true;
  }
  return false;
}

}  // namespace pendula::dae
