#include "integrate/step/increment_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "base/epsilon.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

namespace {
constexpr double least_roundings = 16;  // terms of a sum, each rounded
}

IncrementCheck::Layout IncrementCheck::layout_of(const Problem& problem) {
  const int n = problem.n();
  const auto& p = problem.model().p;
  const std::unordered_set<Expr> parameters(p.begin(), p.end());
  const auto is_constant = [&](Expr e) {
    const std::vector<Expr> inside = leaves({&e, 1});
    return std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return parameters.count(leaf) > 0 || symbol_of(leaf).kind == Kind::constant;
    });
  };
  std::vector<Row> rows(static_cast<std::size_t>(n + problem.m()));
  std::vector<char> suits(rows.size(), 1), varies(rows.size(), 0);
  for (std::size_t k = 0; k < problem.pattern().size(); ++k) {
    const Problem::Entry e = problem.pattern()[k];
    const bool mass = e.column >= n && e.column < 2 * n;
    Row& row = rows[e.row];
    row.row = e.row;
    (mass ? row.mass : row.other).push_back({e.column < n ? e.column : e.column - n, k});
    if (is_constant(problem.partials()[k])) continue;
    varies[e.row] = 1;
    if (mass) suits[e.row] = 0;
  }
  Layout layout;
  int with_slopes = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (!rows[r].mass.empty()) {
      ++with_slopes;
      layout.slopes_return = layout.slopes_return || !suits[r];
    }
    if (rows[r].mass.empty() ? varies[r] : suits[r])
      (rows[r].mass.empty() ? layout.algebraic : layout.rows).push_back(std::move(rows[r]));
  }
  layout.slopes_return = layout.slopes_return || with_slopes > n;
  return layout;
}

IncrementCheck::IncrementCheck(const Problem& problem) {
  static PerEquations<std::shared_ptr<const Layout>> known;
  layout_ = known.of(problem, [&] { return std::make_shared<const Layout>(layout_of(problem)); });
  rows_ = layout_->rows;
  algebraic_ = layout_->algebraic;
  slopes_.resize(rows_.size());
  values_.resize(rows_.size());
  residuals_.resize(rows_.size() + algebraic_.size());
  first_.resize(algebraic_.size());
  harmless_.resize(algebraic_.size());
}

void IncrementCheck::begin() {
  std::fill(slopes_.begin(), slopes_.end(), 0.0);
  std::fill(values_.begin(), values_.end(), 0.0);
  std::fill(residuals_.begin(), residuals_.end(), 0.0);
}

void IncrementCheck::add(const double* xdot, double unit, const double* F, std::ptrdiff_t stride,
                         std::span<const double> entries) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    double slope = 0;
    for (const Term& term : rows_[i].mass) slope += entries[term.entry] * xdot[term.column * stride];
    slope *= unit;
    slopes_[i] = std::max(slopes_[i], std::fabs(slope));
    const double residual = F[rows_[i].row * stride];
    values_[i] = std::max(values_[i], std::fabs(slope - residual));
    residuals_[i] = std::max(residuals_[i], std::fabs(residual));
  }
  double* largest = residuals_.data() + rows_.size();
  for (const Row& row : algebraic_) {
    *largest = std::max(*largest, std::fabs(F[row.row * stride]));
    ++largest;
  }
}

/// The change of a row M x within the tolerances of x.
double IncrementCheck::scale_of(const Row& row, std::span<const double> scale,
                                std::span<const double> entries) const {
  double sum = 0;
  for (const Term& term : row.mass) sum += std::fabs(entries[term.entry]) * scale[term.column];
  return sum;
}

bool IncrementCheck::plausible(double dt, std::span<const double> scale,
                               std::span<const double> entries) const {
  constexpr double visible = 10;  // tolerances: more than the errors of some steps
  constexpr double weights = 2;   // M x′ of the increments may be up to twice what the equations give
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (slopes_[i] > weights * values_[i] && dt * slopes_[i] > visible * scale_of(rows_[i], scale, entries))
      return false;
  return true;
}

/// The change of a row without x′ within the tolerance of the unknown on which it depends least.
double IncrementCheck::least_change(const Row& row, std::span<const double> scale,
                                    std::span<const double> entries) {
  double least = std::numeric_limits<double>::infinity();
  for (const Term& term : row.other)
    if (entries[term.entry] != 0)
      least = std::min(least, std::fabs(entries[term.entry]) * scale[term.column]);
  return least;
}

bool IncrementCheck::is_visible(double dt, const double* F, std::span<const double> scale,
                                std::span<const double> entries) const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [&](const Row& row) {
                       return !(dt * std::fabs(F[row.row]) <= scale_of(row, scale, entries));
                     }) ||
         std::any_of(algebraic_.begin(), algebraic_.end(), [&](const Row& row) {
           return !(std::fabs(F[row.row]) <= least_change(row, scale, entries));
         });
}

bool IncrementCheck::leaves_visible(double dt, std::span<const double> scale,
                                    std::span<const double> entries) const {
  std::size_t i = 0;
  for (const Row& row : rows_)
    if (dt * residuals_[i++] > scale_of(row, scale, entries)) return true;
  for (const Row& row : algebraic_)
    if (residuals_[i++] > least_change(row, scale, entries)) return true;
  return false;
}

void IncrementCheck::set_first(const double* F, std::ptrdiff_t stride) {
  for (std::size_t i = 0; i < algebraic_.size(); ++i) first_[i] = std::fabs(F[algebraic_[i].row * stride]);
}

bool IncrementCheck::stagnates(const double* F, std::ptrdiff_t stride) const {
  for (std::size_t i = 0; i < algebraic_.size(); ++i) {
    const double residual = std::fabs(F[algebraic_[i].row * stride]);
    if (!(residual <= 0.5 * first_[i] || residual <= harmless_[i])) return true;
  }
  return false;
}

bool IncrementCheck::stagnates(const double* F, const double* y, std::span<const double> entries) const {
  // a Newton step on a decaying exponential leaves 1/e, one towards a double root 1/4
  constexpr double most = 0.3;
  for (std::size_t i = 0; i < algebraic_.size(); ++i) {
    const double residual = std::fabs(F[algebraic_[i].row]);
    if (residual <= most * first_[i] || residual <= harmless_[i]) continue;
    if (!(residual <= least_roundings * rounding_of(algebraic_[i], y, entries))) return true;
  }
  return false;
}

double IncrementCheck::rounding_of(const Row& row, const double* y, std::span<const double> entries) {
  double size = 0;
  for (const Term& term : row.other) size += std::fabs(entries[term.entry] * y[term.column]);
  return eps * size;
}

void IncrementCheck::set_harmless(const double* F, const double* y, std::span<const double> entries) {
  // larger residuals than rounding may appear in the following steps
  constexpr double least = 2, roundings = 1024;
  constexpr int steps = 16;
  if (steps_known_ == 0) steps_known_ = steps;
  for (std::size_t i = 0; i < algebraic_.size(); ++i) {
    const double rounding = rounding_of(algebraic_[i], y, entries);
    harmless_[i] = std::max(harmless_[i], std::clamp(least * std::fabs(F[algebraic_[i].row]),
                                                     least_roundings * rounding, roundings * rounding));
  }
}

void IncrementCheck::accept() {
  if (steps_known_ > 0 && --steps_known_ == 0) std::fill(harmless_.begin(), harmless_.end(), 0.0);
}

double IncrementCheck::undamped_norm(double norm, const double* e, double factor,
                                     std::span<const double> scale, std::span<const double> entries) {
  double product = 0, right_size = 0, damped_size = 0;
  ErrorSum undamped;
  for (const Row& row : rows_) {
    double damped = 0, right = 0;
    for (const Term& term : row.mass) damped += factor * entries[term.entry] * e[term.column];
    for (const Term& term : row.other) right += entries[term.entry] * e[term.column];
    right += damped;
    const double unit = factor * scale_of(row, scale, entries);
    damped /= unit;
    right /= unit;
    product += damped * right;
    right_size += right * right;
    damped_size += damped * damped;
    undamped.add(right);
  }
  constexpr double narrow = 0.25;  // cos² 60°
  if (product >= 0 || product * product < narrow * right_size * damped_size) return norm;
  return std::max(norm, undamped.norm(static_cast<int>(rows_.size())));
}

}  // namespace pendula::integrate
