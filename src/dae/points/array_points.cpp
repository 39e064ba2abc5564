#include "dae/points/array_points.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "dae/rank/magnitudes.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/graph/declaration.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double solved_below = 1e-11;  // scaled residual of a point
constexpr int max_iterations = 120;     // exponents decrease by one per Newton step
constexpr double far_away = 1e10;       // times the largest starting value, or 1
constexpr double usual = 300;  // units within 1/300 … 300 remain 1: damped steps from size 1 find such points

/// |r_i| relative to the size of its own terms.
double scaled_size(const Vec& r, const Mat& J, const Vec& w) {
  return r.size() ? r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * w.cwiseAbs()).maxCoeff()
                  : 0;
}

Mat without_small(const Mat& J, double negligible) {
  return J.unaryExpr([&](double v) { return std::fabs(v) <= negligible ? 0.0 : v; });
}

/// Is the Jacobian nearly singular? Near a double root the last Newton steps are rounding errors divided
/// by its distance, 10⁻⁸, and may end by chance; the Jacobian is as small there. A complete loss of rank
/// does not count.
bool is_nearly_singular(Mat J) {
  constexpr double near_double_root =
      1e-7;                           // ten times that distance; with 1e-8 tests/dae/existence_test fails
  constexpr double rounding = 1e-13;  // of the largest σ: smaller ones are the complete loss
  for (Index i = 0; i < J.rows(); ++i)
    if (const double size = J.row(i).cwiseAbs().maxCoeff(); size > 0) J.row(i) /= size;
  const Vec sizes = Eigen::JacobiSVD<Mat>(J).singularValues();
  return (sizes.array() > rounding * sizes[0] && sizes.array() < near_double_root * sizes[0]).any();
}

/// Least-norm Newton steps with one Jacobian. Scaling the unknowns and equations to unit size removes the
/// effect of units and of the growth of high derivatives.
class NewtonStep {
 public:
  NewtonStep(const Mat& J, Index held) : held_(held), columns_(J.cols()) {
    Mat m = J.rightCols(J.cols() - held);
    row_ = Vec::Ones(m.rows());
    column_ = Vec::Ones(m.cols());
    if (m.size() == 0) return;  // everything is held: no step
    const LargestEntries largest = divide_by_largest(m);
    row_ = largest.rows;
    column_ = largest.columns;
    qr_.setThreshold(1e-12);  // pivots below count as undetermined; rounding is 1e-15
    qr_.compute(m);
  }

  /// -J⁺ r in scaled unknowns, in which step sizes are measured.
  Vec scaled(const Vec& r) const {
    return row_.size() == 0 || column_.size() == 0 ? Vec(Vec::Zero(column_.size()))
                                                   : Vec(qr_.solve(Vec(-r.cwiseQuotient(row_))));
  }
  Vec step(const Vec& s) const {
    Vec out = Vec::Zero(columns_);
    out.tail(columns_ - held_) = s.cwiseQuotient(column_);
    return out;
  }

 private:
  Index held_, columns_;
  Vec row_, column_;
  Eigen::CompleteOrthogonalDecomposition<Mat> qr_;
};

}  // namespace

NumericArray::NumericArray(const DerivativeArray& array, Units units)
    : columns_(array.columns()),
      outputs_(array.rows()),
      entries_(array.jacobian()),
      rows_(array.rows().size()),
      states_(array.states().size()),
      first_(array.first().size()),
      equations_(array.equations()) {
  prepare();
  measure_time(
      std::vector<Expr>(outputs_.begin(), outputs_.begin() + static_cast<std::ptrdiff_t>(equations_)));
  measure(units, known(0));
}

NumericArray::NumericArray(std::vector<Expr> rows, std::vector<Expr> columns, Units units,
                           const std::unordered_map<Expr, double>* others)
    : columns_(std::move(columns)),
      outputs_(std::move(rows)),
      entries_(sparse_jacobian(outputs_, columns_)),
      rows_(outputs_.size()),
      states_(0),
      first_(0),
      equations_(rows_) {
  prepare();
  if (!others)
    measure_time(std::vector<Expr>(outputs_.begin(), outputs_.begin() + static_cast<std::ptrdiff_t>(rows_)));
  measure(units, others ? *others : known(0));
}

NumericArray NumericArray::with_columns(std::vector<Expr> order) const {
  std::unordered_map<Expr, int> place;
  for (std::size_t j = 0; j < order.size(); ++j) place[order[j]] = static_cast<int>(j);
  NumericArray other = *this;
  other.evaluator_.reset();
  for (Entry& e : other.entries_) e.column = place.at(columns_[e.column]);
  for (std::size_t j = 0; j < columns_.size(); ++j) other.unit_[place.at(columns_[j])] = unit_[j];
  other.columns_ = std::move(order);
  return other;
}

void NumericArray::prepare() {
  for (const Entry& e : entries_) outputs_.push_back(e.value);
  const std::unordered_set<Expr> unknown(columns_.begin(), columns_.end());
  const std::vector<Expr> slopes(outputs_.begin() + static_cast<std::ptrdiff_t>(rows_), outputs_.end()),
      inside = leaves(slopes);
  linear_ = std::none_of(inside.begin(), inside.end(), [&](Expr leaf) { return unknown.count(leaf) > 0; });
  for (Expr leaf : leaves(outputs_))
    if (!unknown.count(leaf) && symbol_of(leaf).kind != Kind::constant) others_.push_back(leaf);
  unit_ = Vec::Ones(static_cast<Index>(columns_.size()));
  row_unit_ = Vec::Ones(static_cast<Index>(rows_));
}

void NumericArray::measure_time(const std::vector<Expr>& equations) {
  const Expr t = time_symbol();
  if (std::find(others_.begin(), others_.end(), t) == others_.end()) return;
  std::vector<Expr> unknowns = columns_;
  unknowns.push_back(t);
  auto others = known(0);
  others.erase(t);
  const double size =
      magnitudes(equations, equations.size(), unknowns, others, {}).unknowns[std::ssize(columns_)];
  time_unit_ = size < usual && size > 1 / usual ? 1 : size;
}

/// Determines units, but only if the model has sizes far from 1, like nanometres or pascals. Long rows, such
/// as derivatives of high order, are left out: they contain no other information than their equations.
/// Unknowns that occur in them alone get the unit of their integral.
void NumericArray::measure(Units units, const std::unordered_map<Expr, double>& others,
                           const std::vector<std::pair<Expr, double>>& anchors) {
  constexpr std::size_t many = 3000, short_row = 100;  // nodes: of all rows; of one row, if there are more
  if (rows_ == 0 || columns_.empty()) return;
  const bool all = topological(std::span(outputs_).first(rows_)).size() <= many;
  std::vector<Expr> rows;
  std::vector<Index> place;
  for (std::size_t i = 0; i < rows_; ++i)
    if (all || topological({&outputs_[i], 1}).size() <= short_row) {
      rows.push_back(outputs_[i]);
      place.push_back(static_cast<Index>(i));
    }
  Magnitudes m = magnitudes(rows, rows.size(), columns_, others, anchors);
  const auto inside = leaves(rows);
  const std::unordered_set<Expr> measured(inside.begin(), inside.end());
  std::unordered_map<Expr, Index> column;
  for (std::size_t j = 0; j < columns_.size(); ++j) column[columns_[j]] = static_cast<Index>(j);
  for (std::size_t j = 0; j < columns_.size(); ++j)
    for (int order = symbol_of(columns_[j]).order; order >= 0 && !measured.count(columns_[j]); --order) {
      const auto lower = column.find(derivative_leaf(symbol_of(columns_[j]).base, order));
      if (lower == column.end() || !measured.count(lower->first)) continue;
      m.unknowns[j] = m.unknowns[lower->second];
      break;
    }
  if (units == Units::far_from_one && m.unknowns.maxCoeff() < usual && m.unknowns.minCoeff() > 1 / usual)
    return;
  unit_ = std::move(m.unknowns);
  for (std::size_t k = 0; k < place.size(); ++k) row_unit_[place[k]] = m.rows[k];
}

bool NumericArray::suits(const std::unordered_map<Expr, double>& values) const {
  for (std::size_t j = 0; j < columns_.size(); ++j)
    if (const auto at = values.find(columns_[j]);
        at != values.end() && std::fabs(at->second) > usual * unit_[j])
      return false;
  return true;
}

void NumericArray::measure_near(const std::unordered_map<Expr, double>& values) {
  auto others = known(0);
  for (auto& [leaf, value] : others)
    if (const auto at = values.find(leaf); at != values.end()) value = at->second;
  std::vector<std::pair<Expr, double>> anchors;
  for (Expr leaf : columns_)
    if (const auto at = values.find(leaf); at != values.end()) anchors.emplace_back(leaf, at->second);
  unit_.setOnes();
  row_unit_.setOnes();
  measure(Units::far_from_one, others, anchors);
}

Vec NumericArray::start(int seed, const std::unordered_map<Expr, double>& continued) const {
  constexpr double spread[] = {1, 2,   0.3, 5,
                               1, 0.1, 3,   0.01};  // small ones last: near 0 all equations are nearly linear
  const double size = spread[seed / 3 % 8];
  Vec w(static_cast<Index>(columns_.size()));
  for (std::size_t j = 0; j < columns_.size(); ++j) {
    const auto who =
        static_cast<double>(name_hash(columns_[j]) % 10007);  // independent of the order of unknowns
    const double fraction = std::fmod((who + 1) * golden_fraction * (seed + 1), 1.0);
    const auto it = continued.find(columns_[j]);
    const double fresh = seed % 3 == 0 ? std::min(0.3, size) + size * fraction : size * (2 * fraction - 1);
    w[j] = it != continued.end() ? it->second : fresh * unit_[j];
  }
  return w;
}

std::unordered_map<Expr, double> NumericArray::known(int seed) const {
  std::unordered_map<Expr, double> values;
  for (Expr leaf : others_) {
    const Symbol& s = symbol_of(leaf);
    std::mt19937_64 random(std::hash<std::string>()(s.name) * 31 +
                           static_cast<unsigned>(s.order * 7919 + seed));
    values[leaf] =
        (leaf == time_symbol() ? time_unit_ : 1) * std::uniform_real_distribution<double>(0.5, 1.5)(random);
  }
  return values;
}

void NumericArray::evaluate_at(const Vec& w, const std::unordered_map<Expr, double>& known, Vec& r,
                               Mat& J) const {
  if (!evaluator_) {
    std::vector<Expr> all = columns_;
    all.insert(all.end(), others_.begin(), others_.end());
    evaluator_.emplace(outputs_, all);
  }
  std::vector<double> others;
  for (Expr leaf : others_) {
    const auto value = known.find(leaf);
    if (value == known.end()) throw Error(text("no value for '", symbol_of(leaf).name, "'"));
    others.push_back(value->second);
  }
  const auto [values, noise] = evaluate_stable(*evaluator_, w, others, unit_);
  r = Eigen::Map<const Vec>(values.data(), static_cast<Index>(rows_)).cwiseQuotient(row_unit_);
  J = Mat::Zero(static_cast<Index>(rows_), w.size());
  for (std::size_t k = 0; k < entries_.size(); ++k)
    if (!noise[rows_ + k])
      J(entries_[k].row, entries_[k].column) =
          values[rows_ + k] * (unit_[entries_[k].column] / row_unit_[entries_[k].row]);
}

std::optional<NumericArray::Solution> NumericArray::project(Vec w,
                                                            const std::unordered_map<Expr, double>& known,
                                                            Index held, double negligible) const {
  Vec r, next_r;
  Mat J, next_J;
  evaluate_at(w, known, r, J);
  const double farthest =  // derivatives of order 20 are 20! times as large as x
      linear_ ? INFINITY
              : far_away * (w.size() ? std::max(1.0, w.cwiseQuotient(unit_).cwiseAbs().maxCoeff()) : 1);
  constexpr double last_digits = 1e-13;  // 450 ε of the length of w: the next step would be rounding
  // At a root of multiplicity k steps shrink by (k - 1)/k: 0.5 for a double root, 0.95 for k = 20. Quadratic
  // convergence shrinks them by more than 0.1 once or twice only.
  constexpr double fastest = 0.1, slowest = 0.95;
  constexpr double shortest = 1e-5;  // damping factor
  double last_step = INFINITY;
  int linear = 0, longest = 0;  // consecutive steps that shrank by a constant factor only
  const auto is_slow = [&] { return linear >= 5 || (longest >= 12 && is_nearly_singular(J)); };
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_interrupt();
    if (!r.allFinite() || !J.allFinite()) return {};
    const NewtonStep newton(without_small(J, negligible), held);
    const Vec s = newton.scaled(r), step = newton.step(s), omega = w.cwiseQuotient(unit_);
    if (!step.allFinite()) return {};
    const bool solved = scaled_size(r, J, omega) < solved_below;
    const double size = step.norm() / (1 + omega.norm());
    if (w.size() && omega.cwiseAbs().maxCoeff() > farthest) return {};  // no solution: the iteration diverges
    if (solved && size < last_digits) return Solution{w, is_slow()};
    linear = size > fastest * last_step && size < slowest * last_step ? linear + 1 : 0;
    longest = std::max(longest, linear);
    last_step = size;
    // halvings: a circle of radius 10⁻⁶ looks like a point until 20 steps from 1
    constexpr int hopeless = 36;
    if (solved && linear >= hopeless) return Solution{w, true};
    // natural monotonicity: the next step with this Jacobian must be shorter (Deuflhard 2004, §2)
    double alpha = 1;
    for (; alpha > shortest; alpha /= 2) {
      evaluate_at(w + alpha * unit_.cwiseProduct(step), known, next_r, next_J);
      if (next_r.allFinite() && next_J.allFinite() &&
          newton.scaled(next_r).norm() <= (1 - alpha / 4) * s.norm())
        break;
    }
    if (alpha <= shortest) {  // no further decrease: rounding level, or no solution here
      if (!solved) return {};
      return Solution{w, is_slow()};
    }
    w += alpha * unit_.cwiseProduct(step);
    r = next_r;
    J = next_J;
  }
  if (scaled_size(r, J, w.cwiseQuotient(unit_)) < solved_below) return Solution{w, true};
  return {};
}

Mat NumericArray::jacobian(const Vec& w, const std::unordered_map<Expr, double>& known) const {
  Vec r;
  Mat J;
  evaluate_at(w, known, r, J);
  return J;
}

namespace {

/// Ranks of parts of J with largest entries of 1, and of J balanced (rank_in_any_units()). All parts are
/// judged in one matrix: where the balanced one has a higher rank somewhere, and clear gaps, in that one.
class RanksOfParts {
 public:
  explicit RanksOfParts(const Mat& J) : even_(equilibrated(J)) {}

  /// Of the first `rows` rows, without the first `columns` columns.
  RankGap operator()(Index rows, Index columns) {
    const RankGap found = rank_with_gap(even_.topRows(rows).rightCols(even_.cols() - columns));
    lost_ = lost_ || found.rank < std::min(rows, even_.cols() - columns);
    return found;
  }

  /// A rank was below the number of rows and columns, and there is a balanced matrix to look at.
  bool may_be_higher() {
    if (!lost_ || !even_.allFinite()) return false;
    even_ = balance(even_)(even_);
    return even_.allFinite();
  }

 private:
  Mat even_;
  bool lost_ = false;
};

}  // namespace

ArrayRanks NumericArray::ranks(const Solution& at, const std::unordered_map<Expr, double>& known) const {
  Vec r;
  Mat J;
  evaluate_at(at.w, known, r, J);
  const auto x = static_cast<Index>(states_), y = x + static_cast<Index>(first_);
  RanksOfParts rank(J);
  const auto taken = [&] {
    const RankGap all = rank(J.rows(), 0), without_x = rank(J.rows(), x), higher = rank(J.rows(), y);
    ArrayRanks ranks{all.rank, without_x.rank, higher.rank, std::min({all.gap, without_x.gap, higher.gap}),
                     {},       at.slow};
    for (std::size_t rows = equations_; rows < rows_; rows += equations_)
      ranks.prefixes.push_back(
          {rank(static_cast<Index>(rows), x).rank, rank(static_cast<Index>(rows), y).rank});
    return ranks;
  };
  const ArrayRanks first = taken();
  if (!rank.may_be_higher()) return first;
  ArrayRanks second = taken();
  second.balanced = second.gap >= clear_gap && second.all >= first.all && second.y >= first.y &&
                    second.higher >= first.higher &&
                    second.all + second.y + second.higher > first.all + first.y + first.higher;
  return second.balanced ? second : first;
}

}  // namespace pendula::dae
