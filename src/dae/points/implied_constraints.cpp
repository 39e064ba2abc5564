#include "dae/points/implied_constraints.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/search/least_squares.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/graph/depends_on.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Verdict = ConstraintRank::Verdict;

constexpr double found_below =
    1e-7;  // of a residual relative to its terms; a search from afar reaches this or fails
constexpr double holds_below =
    1e-9;  // the same for implied constraints, since positions of independent constraints are exact
constexpr double negligible = 1e-5;  // new part of a unit gradient; positions are exact to 1e-8 or better

/// The residuals relative to the size of their terms.
Vec relative(const Vec& r, const Mat& J, const Vec& omega) {
  return r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * omega.cwiseAbs());
}

/// Is the first of two components of the set of positions the intended one? A linkage may be rigid on one
/// component and mobile on another, like a parallelogram with a third crank: intended is the component with
/// more mobile coordinates. Or joints coincide on one component, as in Peaucellier's linkage: bars between
/// them are then redundant and the rank is lower.
bool is_intended_component(const ConstraintRank& one, const ConstraintRank& other) {
  const auto moves_more = [](const ConstraintRank& a, const ConstraintRank& b) {
    return std::any_of(a.free.begin(), a.free.end(), [&](Expr q) { return !b.free.count(q); });
  };
  const bool more = moves_more(one, other), less = moves_more(other, one);
  return more != less ? more : one.rank > other.rank;
}

/// An orthonormal basis of the null space of independent rows.
Mat free_directions(const Mat& rows) {
  const Index n = rows.cols(), r = rows.rows();
  if (r == 0) return Mat::Identity(n, n);
  const Mat across = rows.transpose();
  return full_q(Eigen::HouseholderQR<Mat>(across).householderQ()).rightCols(n - r);
}

std::vector<Expr> pick(const std::vector<Expr>& list, const std::vector<int>& numbers) {
  std::vector<Expr> out;
  for (int i : numbers) out.push_back(list[i]);
  return out;
}

}  // namespace

ConstraintPositions::ConstraintPositions(const std::vector<Expr>& C, std::vector<Expr> q,
                                         const ParameterValues& values)
    : C_(without_calls(at_values(C, values))),
      q_(std::move(q)),
      all_(C_, q_, NumericArray::Units::always),
      depends_on_time_(
          std::any_of(C_.begin(), C_.end(), [](Expr c) { return depends_on(c, time_symbol()); })) {}

/// A position near the given one by Newton's method, which requires independent gradients. Otherwise
/// it is slow or fails, while least squares in a trust region still converge: the kept constraints
/// bound the distance.
std::optional<Vec> ConstraintPositions::position(const Vec& from, const Known& known) const {
  if (const auto at = all_.project(from, known, 0); at && !at->slow) return at->w;
  const Index n = from.size();
  const auto model = [&](Vec& omega) -> std::optional<QuadraticModel> {
    Vec r;
    Mat J;
    all_.evaluate_at(all_.unit().cwiseProduct(omega), known, r, J);
    if (!r.allFinite() || !J.allFinite()) return {};
    Vec padded = Vec::Zero(std::max(r.size(), n));
    Mat square = Mat::Zero(padded.size(), n);
    padded.head(r.size()) = r;
    square.topRows(r.size()) = J;
    return gauss_newton_model(square, padded);
  };
  Vec start = from.cwiseQuotient(all_.unit());
  if (!model(start)) return {};
  const Vec omega = minimise(model, start, {}).theta, w = all_.unit().cwiseProduct(omega);
  Vec r;
  Mat J;
  all_.evaluate_at(w, known, r, J);
  if (!r.allFinite() || relative(r, J, omega).maxCoeff() > found_below) return {};
  return w;
}

/// Rows with clearly independent gradients. Takes the first row whose new part is at least a third of
/// the largest one.
std::vector<int> ConstraintPositions::well_conditioned(Mat J) const {
  constexpr double enough = 0.3;
  for (Index i = 0; i < J.rows(); ++i)
    if (const double size = J.row(i).norm(); size > 0) J.row(i) /= size;
  std::vector<int> chosen;
  for (;;) {
    const Vec rest = J.rowwise().norm();
    const double largest = rest.maxCoeff();
    if (!(largest > negligible)) break;
    Index next = 0;
    while (rest[next] < enough * largest) ++next;
    const Vec unit = J.row(next).transpose() / rest[next];
    for (int again = 0; again < 2; ++again) J -= (J * unit) * unit.transpose();
    J.row(next).setZero();
    chosen.push_back(static_cast<int>(next));
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

bool ConstraintPositions::all_hold(const Vec& at, const Known& known) const {
  Vec r;
  Mat J;
  all_.evaluate_at(at, known, r, J);
  return r.allFinite() && J.allFinite() &&
         relative(r, J, at.cwiseQuotient(all_.unit())).maxCoeff() <= holds_below;
}

/// |dq/dt| enforced by the kept constraints, in units of q.
double ConstraintPositions::driven_speed(const NumericArray& kept, const std::vector<int>& rows,
                                         const Vec& at, const Known& known) const {
  Known here = known;
  for (std::size_t j = 0; j < q_.size(); ++j) here[q_[j]] = at[j];
  std::vector<Expr> slopes;
  for (int i : rows) slopes.push_back(partial(C_[i], time_symbol()));
  const std::vector<double> values = evaluate(slopes, here);
  const Vec rates =
      Eigen::Map<const Vec>(values.data(), static_cast<Index>(values.size())).cwiseQuotient(kept.row_unit());
  return kept.jacobian(at, known).completeOrthogonalDecomposition().solve(rates).norm();
}

/// Do all constraints hold where the kept ones do, after a step along every free direction and in time? The
/// step is shortened if it leads to no position or a distant one, since q may be small relative to its
/// distance from the origin. It is also shortened if other constraints are violated but have no gradient of
/// their own there: then it has crossed a position at which the kept ones are dependent.
bool ConstraintPositions::hold_nearby(ConstraintRank& found, const NumericArray& kept, const Vec& at,
                                      const Known& known) const {
  constexpr double shares[] = {0.05, 5e-3, 5e-4,
                               5e-5};  // residuals grow like the square of the step if nothing is implied
  const auto r = static_cast<Index>(found.kept.size());
  const Vec omega = at.cwiseQuotient(kept.unit());
  const double size = omega.cwiseAbs().maxCoeff() > 0 ? omega.cwiseAbs().maxCoeff() : 1;
  const Mat free = free_directions(kept.jacobian(at, known));
  const double speed = depends_on_time_ && r ? driven_speed(kept, found.kept, at, known) : 0;
  if (free.cols() == 0 && !depends_on_time_) return true;
  for (Index k = 0; k < std::max<Index>(free.cols(), 1); ++k) {
    bool holds = false;
    for (const double share : shares) {
      const double step = share * size, far = 4 * step;
      Vec moved = at;
      Known later = known;
      if (free.cols()) moved += kept.unit().cwiseProduct(step * free.col(k));
      if (const auto t = later.find(time_symbol()); t != later.end())
        t->second += speed > 0 ? step / speed : step;
      const auto there = kept.project(moved, later, 0);
      const bool is_near = there && !there->slow && (there->w - at).cwiseQuotient(kept.unit()).norm() <= far;
      holds = is_near && all_hold(there->w, later) && rank_with_gap(all_.jacobian(there->w, later)).rank == r;
      if (holds) break;
      const auto other = position(moved, later);
      found.beside = other ? static_cast<int>(well_conditioned(all_.jacobian(*other, later)).size()) : 0;
      if (is_near && found.beside != r) return false;
    }
    if (!holds) return false;
  }
  return true;
}

ConstraintRank ConstraintPositions::judge(const Vec& at, const Known& known) const {
  ConstraintRank found;
  const Mat J = all_.jacobian(at, known);
  if (!J.allFinite()) return found;
  found.kept = well_conditioned(J);
  found.rank = static_cast<int>(found.kept.size());
  found.verdict = Verdict::independent;
  const Mat free = free_directions(J(found.kept, Eigen::all));
  for (std::size_t j = 0; j < q_.size(); ++j) {
    const auto column = static_cast<Index>(j);
    if (free.row(column).lpNorm<Eigen::Infinity>() > negligible) found.free.insert(q_[j]);
    found.units[q_[j]] = all_.unit()[column];
    found.sizes[q_[j]] = at[column] != 0 ? std::fabs(at[column]) : all_.unit()[column];
  }
  if (found.kept.size() == C_.size()) return found;
  found.verdict = Verdict::singular;
  const NumericArray kept(pick(C_, found.kept), q_);
  const auto exact = kept.project(at, known, 0);
  if (!exact || exact->slow || !all_hold(exact->w, known)) return found;
  const RankGap rank = rank_with_gap(all_.jacobian(exact->w, known));
  if (rank.rank < found.rank && (exact->w - at).norm() > 0)
    return judge(exact->w, known);  // `at` was not exact
  if (rank.rank != found.rank || rank.gap < clear_gap || !hold_nearby(found, kept, exact->w, known))
    return found;
  found.verdict = Verdict::implied;
  found.position = known;
  for (std::size_t j = 0; j < q_.size(); ++j) found.position[q_[j]] = exact->w[j];
  return found;
}

ConstraintRank ConstraintPositions::near(const std::unordered_map<Expr, double>& values) const {
  Vec from = Vec::Zero(static_cast<Index>(q_.size()));
  for (std::size_t j = 0; j < q_.size(); ++j)
    if (const auto it = values.find(q_[j]); it != values.end()) from[j] = it->second;
  Known given = all_.known(0);
  for (auto& [leaf, value] : given)
    if (const auto it = values.find(leaf); it != values.end()) value = it->second;
  const auto at = position(from, given);
  return at ? judge(*at, given) : ConstraintRank{};
}

ConstraintRank ConstraintPositions::anywhere() const {
  constexpr int seeds = 12;  // starting values
  ConstraintRank best;
  if (q_.size() > affordable) return best;
  for (int seed = 0; seed < seeds; ++seed) {
    const Known given = all_.known(seed);
    const auto at = position(all_.start(seed), given);
    if (!at) continue;
    const ConstraintRank found = judge(*at, given);
    const bool counts = found.verdict == Verdict::implied || found.verdict == Verdict::independent;
    if (counts && (best.verdict == Verdict::no_position || is_intended_component(found, best))) best = found;
    if (best.verdict == Verdict::independent && best.free.size() == q_.size()) break;
  }
  return best;
}

}  // namespace pendula::dae
