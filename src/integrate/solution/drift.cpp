#include "integrate/solution/drift.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/primes.hpp"

namespace pendula::integrate {
namespace {

constexpr double consistent = 1e-9, visible = 1e-6, rounding = 1e-13;

/// Σ |∂C/∂xⱼ xⱼ|: how large the terms are that cancel in C = 0.
Expr term_size(Expr constraint, const dae::FirstOrder& model) {
  const std::vector<Expr> partials = gradient(constraint, model.x);
  Expr size;
  for (std::size_t j = 0; j < partials.size(); ++j) size += abs(partials[j] * model.x[j]);
  return size;
}

double polynomial(const std::vector<double>& derivatives, double t) {
  double sum = 0;
  for (std::size_t k = derivatives.size(); k-- > 0;)
    sum = derivatives[k] + sum * t / static_cast<double>(k + 1);
  return sum;
}

/// values: one row per time; columns C, C′, …, then the size of the terms of each.
DriftRow measure(const Invariant& invariant, const std::vector<double>& t, const Mat& values) {
  const auto orders = static_cast<Eigen::Index>(invariant.chain.size());
  DriftRow row;
  row.label = invariant.label;
  row.polynomial = invariant.polynomial;
  row.scale = values.col(orders).maxCoeff();
  bool start_holds = true;
  for (Eigen::Index k = 0; k < orders; ++k) {
    const double value = values(0, k), size = values.col(orders + k).maxCoeff();
    const bool zero = std::fabs(value) <= consistent * size;
    start_holds = start_holds && zero;
    row.start.push_back(std::fabs(value) <= rounding * size ? 0 : value);
  }
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double law = invariant.polynomial ? polynomial(row.start, t[i] - t[0]) : 0;
    const double value = values(static_cast<Eigen::Index>(i), 0);
    row.predicted = law;
    row.predicted_max = std::max(row.predicted_max, std::fabs(law));
    row.remainder = std::max(row.remainder, std::fabs(value - law));
    row.largest = std::max(row.largest, std::fabs(value));
  }
  const bool drifts = row.remainder > visible * row.scale;
  const bool off = !start_holds && invariant.polynomial;
  row.verdict = off && row.remainder > 0.1 * row.predicted_max ? Verdict::both
                : off                                          ? Verdict::inconsistent_start
                : drifts                                       ? Verdict::numerical
                                                               : Verdict::kept;
  return row;
}

/// Two digits, and nothing below the rounding of the terms: the same text on every processor.
std::string shown(double value, const DriftRow& row) {
  return std::fabs(value) <= rounding * row.scale ? "0" : rounded(value, 2);
}

/// A bound: two digits, rounded up.
std::string below(double value, const DriftRow& row) {
  if (std::fabs(value) <= rounding * row.scale) return "the rounding level";
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return rounded(std::ceil(value / unit) * unit, 2);
}

/// "C₁′(0) = 0.1" for whatever does not vanish at the start.
std::string broken_conditions(const DriftRow& row) {
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < row.start.size(); ++k)
    if (std::fabs(row.start[k]) > consistent * row.scale)
      parts.push_back(text(row.label, primes(static_cast<int>(k)), "(0) = ", rounded(row.start[k], 6)));
  return join(parts, ", ");
}

std::string sentence(const DriftRow& row) {
  switch (row.verdict) {
    case Verdict::kept:
      return row.polynomial
                 ? text("the start is consistent and the constraint is kept: |", row.label, "| stays below ",
                        below(row.largest, row))
                 : text("the constraint is kept: |", row.label, "| stays below ", below(row.largest, row));
    case Verdict::inconsistent_start:
      return text("inconsistent start, ", broken_conditions(row), ": the model imposes only ", row.label,
                  primes(static_cast<int>(row.start.size())), " = 0, so ", row.label,
                  row.start.size() == 2 ? " follows the straight line C(0) + t C′(0)"
                                        : " follows its Taylor polynomial",
                  ", whatever the accuracy; the numerical part is below ", below(row.remainder, row));
    case Verdict::numerical:
      return text("numerical drift up to ", rounded(row.remainder, 2),
                  row.polynomial ? ", although the start is consistent" : "",
                  ": a smaller dt or a method of higher order reduces it");
    case Verdict::both:
      return text("inconsistent start, ", broken_conditions(row), ", and numerical drift up to ",
                  rounded(row.remainder, 2),
                  ": correct the start first, then take a smaller dt or a method of higher order");
  }
  return "";
}

}  // namespace

std::string verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kept:
      return "kept";
    case Verdict::inconsistent_start:
      return "inconsistent start";
    case Verdict::numerical:
      return "numerical drift";
    case Verdict::both:
      return "inconsistent start and numerical drift";
  }
  return "";
}

std::string Drift::verdict() const {
  bool start = false, numerical = false;
  for (const DriftRow& row : rows) {
    start = start || row.verdict == Verdict::inconsistent_start || row.verdict == Verdict::both;
    numerical = numerical || row.verdict == Verdict::numerical || row.verdict == Verdict::both;
  }
  return verdict_name(start && numerical ? Verdict::both
                      : start            ? Verdict::inconsistent_start
                      : numerical        ? Verdict::numerical
                                         : Verdict::kept);
}

Drift drift(const Solution& solution, const std::vector<Invariant>& invariants) {
  Drift result;
  if (solution.size() == 0) solution.final();  // throws
  result.from = solution.t().front();
  result.to = solution.t().back();
  for (const Invariant& invariant : invariants) {
    std::vector<Expr> wanted = invariant.chain;
    for (Expr c : invariant.chain) wanted.push_back(term_size(c, solution.problem().model()));
    result.rows.push_back(measure(invariant, solution.t(), solution.values(wanted)));
  }
  return result;
}

std::string Drift::str() const {
  if (rows.empty() && has_regimes)
    return "no constraint holds in every regime of the model; plot(sol, e) shows what is 0 in one of them\n";
  if (rows.empty()) return "the model has no constraints: nothing can drift\n";
  const std::string end = text("t = ", rounded(to, 6));
  const bool line = std::any_of(rows.begin(), rows.end(), [](const DriftRow& row) { return row.polynomial; });
  Table table(line ? std::vector<bool>{false, true, true, true, true} : std::vector<bool>{false, true, true});
  if (line)
    table.row({"constraint", "C(0)", "C′(0)", "C(0) + t C′(0) at " + end, "numerical part"});
  else
    table.row({"constraint", "C(0)", "largest |C|"});
  table.rule();
  for (const DriftRow& row : rows) {
    const std::string slope = row.start.size() > 1 ? shown(row.start[1], row) : "";
    if (line)
      table.row(
          {row.label, shown(row.start[0], row), slope, shown(row.predicted, row), shown(row.remainder, row)});
    else
      table.row({row.label, shown(row.start[0], row), shown(row.largest, row)});
  }
  std::string result = table.str();
  for (const DriftRow& row : rows) result += row.label + ": " + sentence(row) + ".\n";
  return result;
}

}  // namespace pendula::integrate
