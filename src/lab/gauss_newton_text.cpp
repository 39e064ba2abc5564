// The text and table of a least-squares run.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.hpp"
#include "base/text.hpp"
#include "lab/gauss_newton.hpp"
#include "lab/printed.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
constexpr int widest_x = 5, rows_before = 10, rows_after = 6;  // what a screen of 80 columns holds
constexpr double shown_as_zero = 1e-9;  // of the start: what is left when seven digits are right, and squared

std::string heading(const NumericFunction& f, const GaussNewtonSettings& settings,
                    const GaussNewtonRun& run) {
  const auto taken = std::count_if(run.lambda.begin(), run.lambda.end(), [](double l) { return l > 0; });
  std::string how = settings.damping == Damping::marquardt ? "Levenberg–Marquardt" : "Gauss–Newton";
  if (settings.damping == Damping::fixed && settings.alpha != 1) how += ", α = " + rounded(settings.alpha, 6);
  std::string out =
      text(how, ", min ½‖R(x)‖² with ", f.outputs, f.outputs == 1 ? " residual in " : " residuals in ", f.n(),
           f.n() == 1 ? " unknown: " : " unknowns: ", run.iterations(),
           run.iterations() == 1 ? " iteration, " : " iterations, ", ending_name(run.ending), "\n");
  out += "  the Hessian JᵀJ + Σ Rᵢ ∇²Rᵢ is approximated by JᵀJ, J = ∂R/∂x\n";
  if (taken > 0 && settings.damping == Damping::automatic)
    out += text("  Gauss–Newton found no smaller ‖R‖ in ", taken, taken == 1 ? " iteration" : " iterations",
                ": Levenberg–Marquardt steps (JᵀJ + λD²) there\n");
  return out;
}

std::string table_text(const NumericFunction& f, const GaussNewtonRun& run) {
  const Index shown = std::min<Index>(f.n(), widest_x);
  const bool damped = std::any_of(run.alpha.begin(), run.alpha.end(), [](double a) { return a < 1; });
  const bool marquardt = std::any_of(run.lambda.begin(), run.lambda.end(), [](double l) { return l > 0; });
  const bool errors = !run.observed.error.empty();
  std::vector<std::string> head = {"k"};
  for (Index j = 0; j < shown; ++j) head.push_back(f.unknowns[j]);
  head.insert(head.end(), {"‖R‖", "‖JᵀR‖"});
  if (damped) head.push_back("α");
  if (marquardt) head.push_back("λ");
  if (errors) head.insert(head.end(), {"‖e₊‖/‖e‖", "order"});
  Table table(std::vector<bool>(head.size(), true));
  table.row(head);
  const std::size_t n = run.x.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (n > rows_before + rows_after + 1 && k == rows_before) {
      table.row({"…"});
      k = n - rows_after;
    }
    std::vector<std::string> row = {std::to_string(k)};
    for (Index j = 0; j < shown; ++j) row.push_back(rounded(run.x[k][j], 9));
    row.push_back(run.exact_data && run.norm[k] < shown_as_zero * run.norm[0] ? "≈ 0"
                                                                              : rounded(run.norm[k], 7));
    row.push_back(run.gradient[k] > shown_as_zero * run.gradient[0] ? printed("%.*e", 1, run.gradient[k])
                                                                    : "≈ 0");
    if (damped) row.push_back(k == 0 ? "" : rounded(run.alpha[k - 1], 4));
    if (marquardt) row.push_back(k == 0 ? "" : run.lambda[k - 1] > 0 ? rounded(run.lambda[k - 1], 1) : "0");
    if (errors) {
      const double ratio = run.observed.ratio(k, 1), order = run.observed.order_at(k);
      row.push_back(ratio > 0 ? rounded(ratio, 4) : "");
      row.push_back(order > 0 ? printed("%.*f", 2, order) : "");
    }
    table.row(row);
  }
  return table.str(2);
}

std::string parameters_text(const NumericFunction& f, const GaussNewtonRun& run) {
  Table table({false, false, true, false, true});
  for (Index j = 0; j < f.n(); ++j) {
    const std::string& name = f.unknowns[j];
    if (run.exact_data || run.covariance.size() == 0)
      table.row({name, "=", rounded(run.x.back()[j])});
    else
      table.row({name, "=", rounded(run.x.back()[j]), "±", rounded(std::sqrt(run.covariance(j, j)), 4)});
  }
  std::string out = table.str(2);
  if (run.exact_data)
    out += "  R = 0 to rounding: there is no noise to estimate a standard deviation from\n";
  else if (run.covariance.size())
    out += text("  σ² = ‖R‖²/(", f.outputs, " - ", f.n(), ") = ", rounded(run.variance, 6),
                "; ± is one standard deviation from the covariance σ²(JᵀJ)⁻¹\n");
  else if (run.rank == f.n())
    out += text("  as many unknowns as residuals: nothing is left to estimate σ² from\n");
  return out;
}

std::string rate_text(const GaussNewtonRun& run) {
  const Observed& seen = run.observed;
  std::string order = seen.order > 0 ? ", observed order " + printed("%.*f", 2, seen.order) : "";
  if (!run.predicted) return text("Converged", order, ".");
  const double neglected = *run.predicted;
  if (run.alpha.back() < 1 && neglected > visibly_linear)
    return text("Converged linearly", seen.rate > 0 ? text(": ‖e₊‖ ≈ ", rounded(seen.rate, 3), " ‖e‖") : "",
                "; damping and the neglected term predict ", rounded(neglected, 3),
                ", the spectral radius of I - α (JᵀJ)⁻¹(JᵀJ + S) with α = ", rounded(run.alpha.back(), 4),
                ".");
  constexpr double slow = 0.7;  // 40 steps to six digits: a choice
  if (neglected > visibly_linear)
    return text(
        "Converged linearly", seen.rate > 0 ? text(": ‖e₊‖ ≈ ", rounded(seen.rate, 3), " ‖e‖") : "",
        ", explained by the neglected term S = Σ Rᵢ ∇²Rᵢ: the spectral radius of (JᵀJ)⁻¹S is ",
        rounded(neglected, 3),
        neglected > slow ? "; residuals this large need Newton's method with the exact Hessian." : ".");
  if (neglected > linear_in_the_end)
    return text("Converged fast",
                seen.rate > 0 ? text(", in the end with ‖e₊‖ ≈ ", rounded(seen.rate, 3), " ‖e‖") : "",
                ": the neglected term S = Σ Rᵢ ∇²Rᵢ is small, the spectral radius of (JᵀJ)⁻¹S is ",
                rounded(neglected, 3), ".");
  constexpr double none = 1e-9;  // S of a linear R is rounding: some ε times a condition number
  return text("Converged", seen.order >= 1.5 || run.exact_data ? " quadratically" : "", order,
              ": the neglected term S = Σ Rᵢ ∇²Rᵢ is ", neglected < none ? "zero" : "very small",
              " at the solution, so JᵀJ is the Hessian",
              run.exact_data     ? " (the residuals vanish)."
              : neglected < none ? " (R is linear there)."
                                 : ".");
}

std::string ending_text(const NumericFunction& f, const GaussNewtonRun& run) {
  if (run.converged()) {
    std::string out = rate_text(run);
    if (run.curvature < 0)
      out += " The exact Hessian is indefinite here: a saddle of ½‖R‖², not a minimum; start elsewhere.";
    return out;
  }
  if (run.ending == GaussNewtonEnding::undefined) {
    const std::string what = f.undefined ? f.undefined(run.x.back()) : "";
    return text("Stopped: R or ∂R/∂x is not finite beyond iterate ", run.iterations(),
                what.empty() ? "" : "; ", what, ". Start where R is defined.");
  }
  if (run.ending == GaussNewtonEnding::diverged) {
    const bool residual = run.norm.back() > 10 * run.norm.front();
    return text(
        "Diverged: ", residual ? "‖R‖" : "‖x‖", " has grown from ",
        rounded(residual ? run.norm.front() : run.x.front().norm(), 3), " to ",
        rounded(residual ? run.norm.back() : run.x.back().norm(), 3),
        ", where not all unknowns have an influence on R. Use alpha = \"line search\", or start elsewhere.");
  }
  if (run.ending == GaussNewtonEnding::stalled)
    return text("Stalled: no step from iterate ", run.iterations(),
                " makes ‖R‖ = ", rounded(run.norm.back(), 6),
                " smaller. Scale the unknowns to similar size or start elsewhere.");
  return text("Not converged after ", run.iterations(), " iterations: raise max, or start nearer.");
}

}  // namespace

std::string undetermined_text(const std::vector<std::string>& names, const Mat& directions) {
  std::string out;
  for (Index k = 0; k < directions.cols(); ++k) {
    const Vec v = directions.col(k);
    const double largest = v.cwiseAbs().maxCoeff();
    std::vector<Index> moving;
    for (Index j = 0; j < v.size(); ++j)
      if (std::fabs(v[j]) > no_component * largest) moving.push_back(j);
    const auto name = [&](std::size_t i) { return names[moving[i]]; };
    if (moving.size() == 1) {
      out += text("Not determined: ", name(0), " does not change R here. ");
      continue;
    }
    out += text("Not determined: R does not change, to first order, when ", direction_text(names, v), ". ");
    if (moving.size() == 2 && directions.cols() == 1) {
      const double ratio = -v[moving[0]] / v[moving[1]];  // the combination a + ratio b is constant
      const std::string size = rounded(std::fabs(ratio), 4);
      out += text("Only the combination ", name(0), ratio < 0 ? " - " : " + ", size == "1" ? "" : size + " ",
                  name(1), " is. ");
    }
  }
  if (!out.empty()) out += "The shortest steps from the start were taken; fix one of them, or add residuals.";
  return out;
}

std::string gauss_newton_text(const NumericFunction& R, const GaussNewtonSettings& settings,
                              const GaussNewtonRun& run) {
  return heading(R, settings, run) + table_text(R, run) + parameters_text(R, run) + wrapped(run.verdict);
}

std::string gauss_newton_verdict(const NumericFunction& R, const GaussNewtonRun& run) {
  std::string out = ending_text(R, run);
  if (run.ending == GaussNewtonEnding::diverged) return out;  // the end of a diverging run is not described
  const std::string free = undetermined_text(R.unknowns, run.undetermined);
  if (!free.empty()) out += (out.empty() ? "" : " ") + free;
  return out;
}

}  // namespace pendula::lab
