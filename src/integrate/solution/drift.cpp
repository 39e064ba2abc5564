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

/// Σ |∂C/∂xⱼ xⱼ|: the size of the terms that cancel in C = 0.
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

/// The solution of C″ + 2α C′ + β² C = 0, α ≠ β.
double damped(double C, double slope, double alpha, double beta, double t) {
  const double d = (alpha - beta) * (alpha + beta), s = std::sqrt(std::fabs(d));
  const double rise = slope + alpha * C, fade = std::exp(-alpha * t);
  if (d < 0) return fade * (C * std::cos(s * t) + rise * std::sin(s * t) / s);
  if (s * t < 1) return fade * (C * std::cosh(s * t) + rise * std::sinh(s * t) / s);
  const double slow = std::exp((s - alpha) * t), fast = std::exp(-(s + alpha) * t);
  return C * (slow + fast) / 2 + rise * (slow - fast) / (2 * s);
}

/// (d/dt + α)ᵏ C = 0: e^{αt} C is the polynomial with the derivatives Σᵢ binom(j, i) α^{j-i} C⁽ⁱ⁾(0).
double decaying(std::vector<double> derivatives, double alpha, double t) {
  for (std::size_t last = derivatives.size(); last-- > 1;)
    for (std::size_t j = derivatives.size() - 1; j >= derivatives.size() - last; --j)
      derivatives[j] += alpha * derivatives[j - 1];
  return std::exp(-alpha * t) * polynomial(derivatives, t);
}

struct Gains {
  double alpha = 0, beta = 0;
};

double by_law(const DriftRow& row, const Gains& gains, double t) {
  switch (row.law) {
    case dae::DriftLaw::none:
      return 0;
    case dae::DriftLaw::polynomial:
      return polynomial(row.start, t);
    case dae::DriftLaw::decay:
      return row.start.size() == 2 && gains.alpha != gains.beta
                 ? damped(row.start[0], row.start[1], gains.alpha, gains.beta, t)
                 : decaying(row.start, gains.alpha, t);
  }
  return 0;
}

/// values: one row per time; columns C, C′, …, then the size of the terms of each.
DriftRow measure(const Invariant& invariant, const std::vector<double>& t, const Mat& values,
                 const Gains& gains) {
  const auto orders = static_cast<Eigen::Index>(invariant.chain.size());
  DriftRow row;
  row.label = invariant.label;
  row.law = invariant.law;
  row.scale = values.col(orders).maxCoeff();
  bool start_holds = true;
  for (Eigen::Index k = 0; k < orders; ++k) {
    const double value = values(0, k), size = values.col(orders + k).maxCoeff();
    const bool zero = std::fabs(value) <= consistent * size;
    start_holds = start_holds && zero;
    row.start.push_back(std::fabs(value) <= rounding * size ? 0 : value);
  }
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double law = by_law(row, gains, t[i] - t[0]);
    const double value = values(static_cast<Eigen::Index>(i), 0);
    row.predicted = law;
    row.predicted_max = std::max(row.predicted_max, std::fabs(law));
    if (start_holds || i > 0 || row.law != dae::DriftLaw::none)  // a projection acts from the first step on
      row.remainder = std::max(row.remainder, std::fabs(value - law));
    row.largest = std::max(row.largest, std::fabs(value));
  }
  const bool drifts = row.remainder > visible * row.scale;
  const bool off = !start_holds;
  const double least = row.law == dae::DriftLaw::none ? visible * row.scale : 0.1 * row.predicted_max;
  row.verdict = off && row.remainder > least ? Verdict::both
                : off                        ? Verdict::inconsistent_start
                : drifts                     ? Verdict::numerical
                                             : Verdict::kept;
  return row;
}

/// Two digits, and 0 below the rounding of the terms, so that the text is the same on every processor.
std::string shown(double value, const DriftRow& row) {
  return std::fabs(value) <= rounding * row.scale ? "0" : rounded(value, 2);
}

/// An upper bound with two digits.
std::string below(double value, const DriftRow& row) {
  if (std::fabs(value) <= rounding * row.scale) return "the rounding level";
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return rounded(std::ceil(value / unit) * unit, 2);
}

/// "C₁′(0) = 0.1" for each condition that the start violates.
std::string broken_conditions(const DriftRow& row) {
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < row.start.size(); ++k)
    if (std::fabs(row.start[k]) > consistent * row.scale)
      parts.push_back(text(row.label, primes(static_cast<int>(k)), "(0) = ", rounded(row.start[k], 6)));
  return join(parts, ", ");
}

/// "the model imposes only C″ = 0, so C follows …"
std::string law_in_words(const DriftRow& row) {
  const std::string& C = row.label;
  const std::size_t k = row.start.size();
  if (row.law == dae::DriftLaw::decay)
    return text("the model imposes ",
                k == 1   ? text(C, "′ + α ", C, " = 0")
                : k == 2 ? text(C, "″ + 2α ", C, "′ + β² ", C, " = 0")
                         : text("(d/dt + α)", superscript(static_cast<long>(k)), " ", C, " = 0"),
                ", so ", C, " decays");
  return text("the model imposes only ", C, primes(static_cast<int>(k)), " = 0, so ", C,
              k == 2 ? " follows the straight line C(0) + t C′(0)" : " follows its Taylor polynomial");
}

std::string sentence(const DriftRow& row) {
  switch (row.verdict) {
    case Verdict::kept:
      return row.law == dae::DriftLaw::polynomial
                 ? text("the start is consistent and the constraint is kept: |", row.label, "| stays below ",
                        below(row.largest, row))
                 : text("the constraint is kept: |", row.label, "| stays below ", below(row.largest, row));
    case Verdict::inconsistent_start:
      if (row.law == dae::DriftLaw::none)
        return text("inconsistent start, ", broken_conditions(row),
                    ": from the first step on the constraint is kept: |", row.label, "| stays below ",
                    below(row.remainder, row));
      return text("inconsistent start, ", broken_conditions(row), ": ", law_in_words(row),
                  ", whatever the accuracy; the numerical part is below ", below(row.remainder, row));
    case Verdict::numerical:
      return text("numerical drift up to ", rounded(row.remainder, 2),
                  row.law == dae::DriftLaw::polynomial ? ", although the start is consistent" : "",
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
    Gains gains;
    if (invariant.law == dae::DriftLaw::decay) {
      const Vec numbers = solution.values(invariant.decay, result.from);
      gains = {numbers[0], numbers[1]};
    }
    result.rows.push_back(measure(invariant, solution.t(), solution.values(wanted), gains));
  }
  return result;
}

std::string Drift::str() const {
  if (rows.empty() && has_regimes)
    return "no constraint holds in every regime of the model; plot(sol, e) shows what is 0 in one of them\n";
  if (rows.empty()) return "the model has no constraints: nothing can drift\n";
  const std::string end = text("t = ", rounded(to, 6));
  const auto any = [&](dae::DriftLaw law) {
    return std::any_of(rows.begin(), rows.end(), [&](const DriftRow& row) { return row.law == law; });
  };
  const bool line = any(dae::DriftLaw::polynomial), follows = line || any(dae::DriftLaw::decay);
  Table table(follows ? std::vector<bool>{false, true, true, true, true}
                      : std::vector<bool>{false, true, true});
  if (follows)
    table.row({"constraint", "C(0)", "C′(0)", (line ? "C(0) + t C′(0) at " : "decays to, at ") + end,
               "numerical part"});
  else
    table.row({"constraint", "C(0)", "largest |C|"});
  table.rule();
  for (const DriftRow& row : rows) {
    const std::string slope = row.start.size() > 1 ? shown(row.start[1], row) : "";
    if (follows)
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
