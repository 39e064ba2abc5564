#include "dae/start/continuation_check.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/numeric_arrays.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {

ContinuationCheck::ContinuationCheck(const Model& model, const NumericArray& numeric)
    : model_(model), numeric_(numeric), scale_(INFINITY) {
  for (const Variable& v : model.variables)
    scale_ = std::min(scale_, unit_of(v.leaf) / unit_of(derivative_leaf(v.leaf)));
}

double ContinuationCheck::unit_of(Expr leaf) const {
  const auto& all = numeric_.columns();
  const auto at = std::find(all.begin(), all.end(), leaf);
  return at == all.end() ? 1 : numeric_.unit()[at - all.begin()];
}

bool ContinuationCheck::holds(const Continuation& continuation) const {
  const ContinuationExpansion along = expansion(model_, continuation, true).value_or(straight(continuation));
  for (std::size_t j = 0; j < along.derivatives.size(); ++j) {
    const auto& [leaf, d] = along.derivatives[j];
    for (std::size_t order = 1; order < d.size(); ++order) {
      const Expr own = derivative_leaf(leaf, static_cast<int>(order));
      if (std::find(continuation.differs.begin(), continuation.differs.end(), own) ==
          continuation.differs.end())
        continue;
      const double unit = unit_of(own);
      const auto asked = continuation.values.find(own);
      const bool moved = asked != continuation.values.end() &&
                         std::fabs(d[order] - asked->second) > same_derivative * (unit + std::fabs(d[order]));
      if (moved || !is_least(continuation, along, {j, order}, unit)) return false;
    }
  }
  return true;
}

bool ContinuationCheck::exists_along(const Continuation& continuation) const {
  return exists_along(continuation, expansion(model_, continuation, true).value_or(straight(continuation)));
}

/// Is there a solution near the continuation? Without one, a residual remains, or the nearest solution is the
/// meeting point itself.
bool ContinuationCheck::exists_along(const Continuation& continuation,
                                     const ContinuationExpansion& along) const {
  // The step ahead is a hundredth of the time in which unknowns change by their units. There a straight line
  // has an error of 0.01², and solutions whose slopes differ by one unit are 0.01 apart; `share`, relative to
  // 0.01, lies between. (The tests of starts pass with a tenth and ten
  // times either.)
  constexpr double ahead = 0.01, share = 0.1;
  const NumericArray& equations = numeric_arrays(model_)->of_order(0);
  PointValues values = continuation.values;
  for (const auto& [leaf, value] : along.at(continuation.values.at(time_symbol()) + ahead * scale_))
    values[leaf] = value;
  auto known = equations.known(0);
  for (auto& [leaf, value] : known)
    if (const auto given = values.find(leaf); given != values.end()) value = given->second;
  Vec w(static_cast<Eigen::Index>(equations.columns().size()));
  for (Eigen::Index j = 0; j < w.size(); ++j) {
    const auto given = values.find(equations.columns()[j]);
    if (given == values.end()) return true;  // no value to start from
    w[j] = given->second;
  }
  constexpr int iterations = 30;      // at a double root each step is half of the one before
  constexpr double converged = 1e-6;  // of the change, hence 10⁻⁸ of a unit: a double root is known to √ε
  const Vec begin = w, &unit = equations.unit();
  for (int i = 0; i < iterations; ++i) {
    Vec r;
    Mat J;
    equations.evaluate_at(w, known, r, J);
    if (!r.allFinite() || !J.allFinite()) return false;
    const Vec step = Eigen::CompleteOrthogonalDecomposition<Mat>(J).solve(r);
    const Vec rest = r - J * step;
    if (rest.norm() > share * r.norm()) return false;  // the linearised equations have no solution
    if (step.cwiseAbs().maxCoeff() <= converged * ahead) return true;
    w -= unit.cwiseProduct(step);
    if (((w - begin).cwiseAbs().array() > share * ahead * unit.array()).any()) return false;
  }
  return false;
}

ContinuationExpansion ContinuationCheck::straight(const Continuation& continuation) const {
  ContinuationExpansion line{continuation.values.at(time_symbol()), {}};
  for (const Variable& v : model_.variables) {
    const auto value = continuation.values.find(v.leaf),
               slope = continuation.values.find(derivative_leaf(v.leaf));
    if (value != continuation.values.end() && slope != continuation.values.end())
      line.derivatives.push_back({v.leaf, {value->second, slope->second}});
  }
  return line;
}

/// Tests distances between the ranges where rounding and missing derivatives hide the difference.
bool ContinuationCheck::is_least(const Continuation& continuation, const ContinuationExpansion& along,
                                 Place place, double unit) const {
  // With h the residual of the right polynomial decreases faster than that of one with a changed coefficient,
  // so that their ratio falls below any share at some h, unless rounding hides both. The change is the one
  // that distinguishes solutions (same_derivative), or a tenth, since the residual at a double root is the
  // square of a change and would hide a smaller one. (The tests of starts pass with a tenth and ten times
  // each.)
  constexpr double share = 0.3, change = 0.1, least_change = same_derivative;
  // relative to a residual; smaller changes are rounding at the least h, 10⁻⁷
  constexpr double unchanged = 1e-9;
  constexpr int decades = 7;  // from a tenth of the time scale
  const double slope = along.derivatives[place.leaf].second[place.order];
  const double by = change * std::fabs(slope) + least_change * unit;
  double h = 0.1 * scale_;
  for (int k = 0; k < decades; ++k, h /= 10) {
    const Vec here = residuals(continuation, along, h);
    bool least = true, concerned = false;
    for (double sign : {1.0, -1.0}) {
      ContinuationExpansion other = along;
      other.derivatives[place.leaf].second[place.order] = slope + sign * by;
      const Vec there = residuals(continuation, other, h);
      for (Eigen::Index i = 0; i < here.size(); ++i) {
        if (std::fabs(there[i] - here[i]) <= unchanged * std::fabs(there[i])) continue;
        concerned = true;
        least = least && std::fabs(here[i]) <= share * std::fabs(there[i]);
      }
    }
    if (concerned && least) return true;
  }
  return false;
}

Vec ContinuationCheck::residuals(const Continuation& continuation, const ContinuationExpansion& along,
                                 double h) const {
  PointValues values = continuation.values;
  for (const auto& [leaf, value] : along.at(along.t + h)) values[leaf] = value;
  const auto r = evaluate(model_.residuals, values);
  return Eigen::Map<const Vec>(r.data(), static_cast<Eigen::Index>(r.size()));
}

std::vector<Expr> undetermined(const Model& m, const PointValues& at) {
  constexpr double vanishing = 1e-5;  // the point is known to some digits
  std::vector<Expr> slopes, leaves;
  for (Expr top : m.top_derivatives()) leaves.push_back(derivative_leaf(top));
  for (Expr z : m.algebraic()) leaves.push_back(derivative_leaf(z));
  const std::vector<Entry> entries = top_jacobian(m);
  for (const Entry& e : entries) slopes.push_back(e.value);
  const auto numbers = pendula::evaluate(slopes, at);
  Mat J = Mat::Zero(std::ssize(m.residuals), std::ssize(leaves));
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (std::fabs(numbers[k]) > vanishing) J(entries[k].row, entries[k].column) = numbers[k];
  const Mat N = null_space(equilibrated(J));
  const auto tops = std::ssize(m.top_derivatives());
  std::vector<Expr> open;
  for (Eigen::Index i = N.rows(); i-- > 0 && N.cols() > 0;)
    if (N.row(i).norm() >= vanishing && (i >= tops || open.empty())) open.push_back(leaves[i]);
  return open;
}

void name_by(Continuation& continuation, const std::vector<Expr>& leaves, const ContinuationCheck& check) {
  std::vector<std::string> words, keys;
  continuation.differs.clear();
  for (Expr leaf : leaves) {
    const auto value = continuation.values.find(leaf);
    if (value == continuation.values.end()) continue;
    const bool zero = std::fabs(value->second) <= same_derivative * check.unit_of(leaf);
    const std::string digits = rounded(zero ? 0 : value->second, 3);
    words.push_back(text(to_text(leaf), " = ", digits));
    keys.push_back(text(key_text(leaf), " = ", digits));
    continuation.differs.push_back(leaf);
  }
  continuation.text = join(words, ", ");
  continuation.choice = text("{ ", join(keys, ", "), " }");
}

std::optional<Continuation> arrived_continuation(const Model& m, const PointValues& at,
                                                 const ContinuationExpansion& arrived) {
  Continuation continuation{"", at, {}, ""};
  for (const auto& [leaf, value] : arrived.at(at.at(time_symbol()))) continuation.values[leaf] = value;
  const auto arrays = numeric_arrays(m);
  const ContinuationCheck check(m, arrays->of_order(1));
  name_by(continuation, undetermined(m, at), check);
  if (continuation.text.empty() || !check.exists_along(continuation, arrived)) return {};
  return continuation;
}

}  // namespace pendula::dae
