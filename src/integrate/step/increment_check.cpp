#include "integrate/step/increment_check.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

IncrementCheck::IncrementCheck(const Problem& problem) {
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
  std::vector<char> suits(rows.size(), 1);
  for (std::size_t k = 0; k < problem.pattern().size(); ++k) {
    const Problem::Entry e = problem.pattern()[k];
    const bool mass = e.column >= n && e.column < 2 * n;
    Row& row = rows[e.row];
    row.row = e.row;
    (mass ? row.mass : row.other).push_back({e.column < n ? e.column : e.column - n, k});
    if (mass && !is_constant(problem.partials()[k])) suits[e.row] = 0;
  }
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (suits[r] && !rows[r].mass.empty()) rows_.push_back(std::move(rows[r]));
  slopes_.resize(rows_.size());
  values_.resize(rows_.size());
}

void IncrementCheck::begin() {
  std::fill(slopes_.begin(), slopes_.end(), 0.0);
  std::fill(values_.begin(), values_.end(), 0.0);
}

void IncrementCheck::add(const double* xdot, double unit, const double* F, std::ptrdiff_t stride,
                         std::span<const double> entries) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    double slope = 0;
    for (const Term& term : rows_[i].mass) slope += entries[term.entry] * xdot[term.column * stride];
    slope *= unit;
    slopes_[i] = std::max(slopes_[i], std::fabs(slope));
    values_[i] = std::max(values_[i], std::fabs(slope - F[rows_[i].row * stride]));
  }
}

/// The change of a row M x by the tolerances of x.
double IncrementCheck::scale_of(const Row& row, std::span<const double> scale,
                                std::span<const double> entries) const {
  double sum = 0;
  for (const Term& term : row.mass) sum += std::fabs(entries[term.entry]) * scale[term.column];
  return sum;
}

bool IncrementCheck::plausible(double dt, std::span<const double> scale,
                               std::span<const double> entries) const {
  constexpr double weights = 2, visible = 10;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (slopes_[i] > weights * values_[i] && dt * slopes_[i] > visible * scale_of(rows_[i], scale, entries))
      return false;
  return true;
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
  if (product >= 0 || product * product < 0.25 * right_size * damped_size) return norm;
  return std::max(norm, undamped.norm(static_cast<int>(rows_.size())));
}

}  // namespace pendula::integrate
