#include "dae/index/array_points.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "expr/graph/declaration.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double solved_below = 1e-11;  // scaled residual of a point
constexpr int max_iterations = 120;     // exponentials come down by one per Newton step
constexpr double rank_cut = 1e-8;       // relative to σ₁: σ above it always counts
constexpr double rounding = 1e-16;
constexpr double far_away = 1e10;  // starting values are near 1

Mat equilibrated(Mat m) {
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (Index i = 0; i < m.rows(); ++i)
      if (const double s = m.row(i).cwiseAbs().maxCoeff(); s > 0) m.row(i) /= s;
    for (Index j = 0; j < m.cols(); ++j)
      if (const double s = m.col(j).cwiseAbs().maxCoeff(); s > 0) m.col(j) /= s;
  }
  return m;
}

/// |r_i| relative to the size of its own terms.
double scaled_size(const Vec& r, const Mat& J, const Vec& w) {
  return r.size() ? r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * w.cwiseAbs()).maxCoeff()
                  : 0;
}

/// Least-norm Newton steps with one Jacobian, in unknowns and equations scaled to unit size: neither units
/// nor the growth of high derivatives matter.
class NewtonStep {
 public:
  NewtonStep(const Mat& J, Index held) : held_(held), columns_(J.cols()) {
    Mat m = J.rightCols(J.cols() - held);
    row_ = Vec::Ones(m.rows());
    column_ = Vec::Ones(m.cols());
    for (int sweep = 0; sweep < 3; ++sweep) {
      for (Index i = 0; i < m.rows(); ++i)
        if (const double s = m.row(i).cwiseAbs().maxCoeff(); s > 0) {
          m.row(i) /= s;
          row_[i] *= s;
        }
      for (Index j = 0; j < m.cols(); ++j)
        if (const double s = m.col(j).cwiseAbs().maxCoeff(); s > 0) {
          m.col(j) /= s;
          column_[j] *= s;
        }
    }
    qr_.setThreshold(1e-12);  // below it a direction counts as undetermined; rounding is 1e-15
    qr_.compute(m);
  }

  /// -J⁺ r in scaled unknowns: what the size of a step is measured in.
  Vec scaled(const Vec& r) const { return qr_.solve(-r.cwiseQuotient(row_)); }
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

bool has_calls(const std::vector<Expr>& e) {
  const auto nodes = topological(e);
  return std::any_of(nodes.begin(), nodes.end(), [](Expr n) { return n.op() == Op::call; });
}

/// A smooth function of the same arguments without special properties: 2nd-degree terms and a sine.
Expr generic_function(const FunctionCall& f) {
  std::size_t state = std::hash<std::string>()(f.name);
  const auto draw = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return Expr(mpq_class(static_cast<long>((state >> 33) % 89) + 11, 60));
  };
  std::vector<Expr> slots;
  Expr phase = draw(), sum = draw();
  for (std::size_t i = 0; i < f.arguments.size(); ++i) {
    const Expr s = symbol(pendula::Kind::slot, text("arg_", i));
    phase += draw() * s;
    sum += draw() * s + draw() / Expr(7) * s * s;
    if (i > 0) sum += draw() / Expr(5) * s * slots.back();
    slots.push_back(s);
  }
  sum += sin(phase);
  for (std::size_t i = 0; i < slots.size(); ++i)
    for (int k = 0; k < f.partial[i]; ++k) sum = partial(sum, slots[i]);
  Substitution arguments;
  for (std::size_t i = 0; i < slots.size(); ++i) arguments[slots[i]] = f.arguments[i];
  return substitute(sum, arguments);
}

}  // namespace

std::vector<Expr> without_calls(std::vector<Expr> e) {
  while (has_calls(e)) {
    Substitution innermost;
    for (Expr node : topological(e))
      if (node.op() == Op::call && !has_calls(call_of(node).arguments))
        innermost[node] = generic_function(call_of(node));
    e = substitute(e, innermost);
  }
  return e;
}

StableValues evaluate_stable(const Evaluator& outputs, const Vec& w, std::span<const double> others) {
  constexpr double golden = 0.6180339887498949;
  std::vector<double> here(w.begin(), w.end()), moved;
  here.insert(here.end(), others.begin(), others.end());
  moved = here;
  for (std::size_t j = 0; j < static_cast<std::size_t>(w.size()); ++j) {
    const double part = std::fmod((static_cast<double>(j) + 1) * golden, 1.0);
    moved[j] += (0.5 + part) * 1e-10 * (std::fabs(here[j]) + 0.01);
  }
  auto values = outputs(here);
  const auto other = outputs(moved);
  std::vector<char> noise(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    noise[k] = std::fabs(values[k]) <= 10 * std::fabs(values[k] - other[k]);
  return {std::move(values), std::move(noise)};
}

StableValues evaluate_stable(const std::vector<Expr>& outputs, const std::vector<Expr>& columns, const Vec& w,
                             const std::unordered_map<Expr, double>& known) {
  std::vector<Expr> leaves = columns;
  std::vector<double> values;
  for (const auto& [leaf, value] : known) {
    leaves.push_back(leaf);
    values.push_back(value);
  }
  return evaluate_stable(Evaluator(outputs, leaves), w, values);
}

/// The rank, where a QR factorisation with pivoting proves it: with R₁₁ (r × r) and R₂₂ its diagonal blocks,
/// σ_r ≥ 1/‖R₁₁⁻¹‖ and σ_{r+1} ≤ ‖R₂₂‖, Frobenius norms (Golub & Van Loan 2013, §5.4.2). Nothing if the two
/// bounds do not show the widest gap.
static std::optional<RankGap> proved_rank(const Mat& m) {
  const Eigen::ColPivHouseholderQR<Mat> qr(m);
  const Mat& R = qr.matrixQR();
  const Index n = std::min(m.rows(), m.cols()), cols = m.cols();
  Index r = 0;
  while (r < n && std::fabs(R(r, r)) > rank_cut * std::fabs(R(0, 0))) ++r;
  const Mat R11 = R.topLeftCorner(r, r).triangularView<Eigen::Upper>(),
            R22 = R.block(r, r, n - r, cols - r).triangularView<Eigen::Upper>();
  const double most = m.norm();  // ≥ σ₁
  const double last = 1 / (R11.triangularView<Eigen::Upper>().solve(Mat::Identity(r, r)).norm() * most);
  const double next = std::max(R22.norm() / std::fabs(R(0, 0)), rounding);
  if (!(last > rank_cut) || next / rounding > last / next) return {};
  return RankGap{static_cast<int>(r), last / next};
}

RankGap rank_with_gap(const Mat& given) {
  if (given.size() == 0) return {0, 1 / rounding};
  const Mat m = equilibrated(given);
  if (m.isZero(0)) return {0, 1 / rounding};
  if (const auto proved = proved_rank(m)) return *proved;
  const Eigen::JacobiSVD<Mat> svd(m);
  Vec s = svd.singularValues();
  s = (s / s[0]).cwiseMax(rounding);
  RankGap best{static_cast<int>(s.size()), s[s.size() - 1] / rounding};
  if (s[s.size() - 1] > rank_cut) return best;
  best.gap = 0;
  for (Index i = 0; i + 1 < s.size(); ++i)
    if (s[i + 1] <= rank_cut && s[i] / s[i + 1] > best.gap) best = {static_cast<int>(i) + 1, s[i] / s[i + 1]};
  return best;
}

NumericArray::NumericArray(const DerivativeArray& array)
    : columns_(array.columns()),
      outputs_(array.rows()),
      entries_(array.jacobian()),
      rows_(array.rows().size()),
      states_(array.states().size()),
      first_(array.first().size()) {
  prepare();
}

NumericArray::NumericArray(std::vector<Expr> rows, std::vector<Expr> columns)
    : columns_(std::move(columns)),
      outputs_(std::move(rows)),
      entries_(sparse_jacobian(outputs_, columns_)),
      rows_(outputs_.size()),
      states_(0),
      first_(0) {
  prepare();
}

void NumericArray::prepare() {
  for (const Entry& e : entries_) outputs_.push_back(e.value);
  const std::unordered_set<Expr> unknown(columns_.begin(), columns_.end());
  for (Expr leaf : leaves(outputs_))
    if (!unknown.count(leaf) && symbol_of(leaf).kind != pendula::Kind::constant) others_.push_back(leaf);
}

Vec NumericArray::start(int seed, const std::unordered_map<Expr, double>& continued) const {
  constexpr double golden = 0.6180339887498949;
  constexpr double spread[] = {1, 2,   0.3, 5,
                               1, 0.1, 3,   0.01};  // small ones late: there everything is nearly linear
  const double size = spread[seed / 3 % 8];
  Vec w(static_cast<Index>(columns_.size()));
  for (std::size_t j = 0; j < columns_.size(); ++j) {
    const auto who =
        static_cast<double>(name_hash(columns_[j]) % 10007);  // the same in any order of unknowns
    const double fraction = std::fmod((who + 1) * golden * (seed + 1), 1.0);
    const auto it = continued.find(columns_[j]);
    const double fresh = seed % 3 == 0 ? std::min(0.3, size) + size * fraction : size * (2 * fraction - 1);
    w[static_cast<Index>(j)] = it != continued.end() ? it->second : fresh;
  }
  return w;
}

std::unordered_map<Expr, double> NumericArray::known(int seed) const {
  std::unordered_map<Expr, double> values;
  for (Expr leaf : others_) {
    const Symbol& s = symbol_of(leaf);
    std::mt19937_64 random(std::hash<std::string>()(s.name) * 31 +
                           static_cast<unsigned>(s.order * 7919 + seed));
    values[leaf] = std::uniform_real_distribution<double>(0.5, 1.5)(random);
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
  const auto [values, noise] = evaluate_stable(*evaluator_, w, others);
  r = Eigen::Map<const Vec>(values.data(), static_cast<Index>(rows_));
  J = Mat::Zero(static_cast<Index>(rows_), w.size());
  for (std::size_t k = 0; k < entries_.size(); ++k)
    if (!noise[rows_ + k]) J(entries_[k].row, entries_[k].column) = values[rows_ + k];
}

std::optional<NumericArray::Solution> NumericArray::project(Vec w,
                                                            const std::unordered_map<Expr, double>& known,
                                                            Index held) const {
  Vec r, next_r;
  Mat J, next_J;
  evaluate_at(w, known, r, J);
  double last_step = INFINITY;
  int linear = 0;  // steps in a row that shrank only by a constant factor
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_interrupt();
    if (!r.allFinite() || !J.allFinite()) return {};
    const NewtonStep newton(J, held);
    const Vec s = newton.scaled(r), step = newton.step(s);
    if (!step.allFinite()) return {};
    const bool solved = scaled_size(r, J, w) < solved_below;
    const double size = step.norm() / (1 + w.norm());
    if (w.size() && w.cwiseAbs().maxCoeff() > far_away) return {};  // no solution: it runs off to infinity
    if (solved && size < 1e-13) return Solution{w, linear >= 5};
    linear = size > 0.1 * last_step && size < 0.95 * last_step ? linear + 1 : 0;
    last_step = size;
    constexpr int hopeless = 36;  // halvings: a circle of radius 10⁻⁶ is a point until 20 steps from 1
    if (solved && linear >= hopeless) return Solution{w, true};
    double alpha =
        1;  // natural monotonicity: the next step, with this Jacobian, is shorter (Deuflhard 2004, §2)
    for (; alpha > 1e-5; alpha /= 2) {
      evaluate_at(w + alpha * step, known, next_r, next_J);
      if (next_r.allFinite() && next_J.allFinite() &&
          newton.scaled(next_r).norm() <= (1 - alpha / 4) * s.norm())
        break;
    }
    if (alpha <= 1e-5) {  // no further decrease: rounding level, or no solution here
      if (!solved) return {};
      return Solution{w, linear >= 5};
    }
    w += alpha * step;
    r = next_r;
    J = next_J;
  }
  if (scaled_size(r, J, w) < solved_below) return Solution{w, true};
  return {};
}

ArrayRanks NumericArray::ranks(const Solution& at, const std::unordered_map<Expr, double>& known) const {
  Vec r;
  Mat J;
  evaluate_at(at.w, known, r, J);
  const auto x = static_cast<Index>(states_), n = static_cast<Index>(first_);
  const RankGap all = rank_with_gap(J), y = rank_with_gap(J.rightCols(J.cols() - x)),
                higher = rank_with_gap(J.rightCols(J.cols() - x - n));
  return {all.rank, y.rank, higher.rank, std::min({all.gap, y.gap, higher.gap}), at.slow};
}

}  // namespace pendula::dae
