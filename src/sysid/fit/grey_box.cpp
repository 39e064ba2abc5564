#include "sysid/fit/grey_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/search/least_squares.hpp"
#include "base/text.hpp"
#include "dae/model/make_model.hpp"
#include "expr/print/print.hpp"
#include "sysid/fit/grey_box_experiment.hpp"

namespace pendula::sysid {
namespace {

// of the errors of a simulation over its steps: a choice, as it depends on the model
constexpr double growth = 10;
/// Relative error of y and J after fixed steps. The derivatives are those of the discrete solution, hence
/// their errors are rounding over the steps: 10⁷ of them with ε/2 each.
constexpr double fixed_step_rounding = 1e-9;

/// The end of a search.
struct Found {
  Vec theta;
  GreyBoxPoint at;
  std::vector<double> losses;  ///< SSE, as in GreyBoxFit
  std::vector<Index> active;
  std::string ending;
  bool converged = false;
};

/// Minimises the squared simulation errors from θ, where `at` is the evaluation. Steps to points where the
/// model cannot be integrated are rejected. V is known to the accuracy of the integration.
Found search(std::vector<Experiment>& experiments, const GreyBoxRequest& r, const Vec& theta,
             GreyBoxPoint at) {
  if (theta.size() == 0) return {theta, at, {at.sse}, {}, "", true};
  Vec last = theta;
  const auto loss = [&](Vec& next) -> std::optional<QuadraticModel> {
    next = r.bounds.nearest(next);
    try {
      if (last.size() != next.size() || next != last) at = evaluate(experiments, r, next);
      last = next;
    } catch (const UserFacing&) {
      last.resize(0);
      return {};
    }
    Mat J = -at.J;
    r.bounds.hold(next, J, at.e);
    return gauss_newton_model(J, at.e);
  };
  MinimiserOptions options;
  options.iterations = r.iterations;
  // J errs like the integration, and by rounding at least; columns are taken for dependent at 10⁻⁴ at most,
  // whatever rtol is
  constexpr double rounding = 1e-11, largest = 1e-4;
  options.noise =
      r.dt > 0 ? difference_noise : std::clamp(growth * r.rtol, difference_noise, growth * largest);
  options.accuracy = r.dt > 0 ? rounding : std::clamp(r.rtol, rounding, largest);
  const Minimum m = minimise(loss, theta, options);
  Found found{m.theta, {}, {}, {}, ending_text(m), m.converged()};
  for (const double value : m.values) found.losses.push_back(2 * value);
  if (last.size() != m.theta.size() || last != m.theta) at = evaluate(experiments, r, m.theta);
  Mat J = -at.J;
  found.active = r.bounds.hold(m.theta, J, at.e);
  found.at = std::move(at);
  return found;
}

/// A search from the guess over a sixteenth of every record, then from its result over an eighth, …, finally
/// over the whole. Phase errors grow with time: over the whole record an oscillation of the wrong frequency
/// causes many minima, over less than a period only one. Empty if the model cannot be integrated over a part.
std::optional<Found> search_growing(std::vector<Experiment>& experiments, const GreyBoxRequest& r) {
  std::optional<Found> found;
  Vec theta = r.bounds.nearest(r.guess);
  for (const double share : {1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 1.0}) {
    for (Experiment& experiment : experiments) experiment.shorten(share);
    try {
      found = search(experiments, r, theta, evaluate(experiments, r, theta));
    } catch (const Failure&) {
      for (Experiment& experiment : experiments) experiment.shorten(1);
      return {};
    }
    theta = found->theta;
  }
  return found;
}

/// Σ (y - mean)² of the measured samples.
double variation_of(const IdData& data) {
  double sum = 0;
  for (Index j = 0; j < data.outputs(); ++j) {
    std::vector<double> y;
    for (const double value : data.y.col(j))
      if (!std::isnan(value)) y.push_back(value);
    if (y.empty()) continue;
    const Eigen::Map<const Vec> measured(y.data(), static_cast<Index>(y.size()));
    sum += (measured.array() - measured.mean()).matrix().squaredNorm();
  }
  return sum;
}

void check(const GreyBoxRequest& r) {
  if (static_cast<Index>(r.outputs.size()) != r.data.outputs())
    throw Error(text("y names ", counted(r.outputs.size(), "expression"), ", but the data has ",
                     counted(r.data.outputs(), "output")));
  if (r.data.u.array().isNaN().any())
    throw Error(text(missing_text(r.data), "; inputs must be complete: d:fill()"));
  if (r.data.samples() < 2) throw Error("the data has one sample only");
  for (const Expr p : r.parameters)
    if (is_parameter(p) &&
        std::find(r.model->parameters.begin(), r.model->parameters.end(), p) == r.model->parameters.end())
      throw Error(text("the model has no parameter ", symbol_of(p).name));
}

}  // namespace

double first_value(const GreyBoxRequest& r, Expr state, Index experiment) {
  const Index first = r.data.starts[experiment];
  for (std::size_t j = 0; j < r.outputs.size(); ++j) {
    const auto y = r.data.y.col(static_cast<Index>(j)).segment(first, r.data.end(experiment) - first);
    const bool slope = symbol_of(state).order == 1 && symbol_of(state).base == r.outputs[j];
    if (r.outputs[j] == state && std::isfinite(y[0])) return y[0];
    if (slope && y.size() > 1 && std::isfinite(y[1] - y[0])) return (y[1] - y[0]) / r.data.Ts;
  }
  return 0;
}

namespace {

void add_parameter(GreyBoxRequest& r, Expr p, double value, std::optional<Index> owner) {
  r.parameters.push_back(p);
  r.owner.push_back(owner);
  const Index n = r.guess.size();
  r.guess.conservativeResize(n + 1);
  r.guess[n] = value;
  if (!r.bounds.any()) return;
  r.bounds.lower.conservativeResize(n + 1);
  r.bounds.upper.conservativeResize(n + 1);
  r.bounds.lower[n] = -std::numeric_limits<double>::infinity();
  r.bounds.upper[n] = std::numeric_limits<double>::infinity();
}

/// Makes initial values specific to their experiment: those among the parameters, and those that the
/// start leaves open.
GreyBoxRequest complete(const GreyBoxRequest& given) {
  GreyBoxRequest r = given;
  const auto count = given.parameters.size();
  r.owner.assign(count, {});
  const Index experiments = given.data.experiments();
  for (std::size_t i = 0; i < count && experiments > 1; ++i) {
    if (is_parameter(given.parameters[i])) continue;
    r.owner[i] = 0;
    for (Index k = 1; k < experiments; ++k)
      add_parameter(r, given.parameters[i], first_value(given, given.parameters[i], k), k);
  }
  for (Index k = 0; k < experiments; ++k)
    for (const auto& [state, value] : Experiment(given, k).open_values(given.guess))
      add_parameter(r, state, value, experiments > 1 ? std::optional(k) : std::nullopt);
  return r;
}

std::string name_of(const GreyBoxRequest& r, std::size_t i) {
  const Expr p = r.parameters[i];
  if (is_parameter(p)) return to_text(p);
  return to_text(p) + (r.owner[i] ? text("(0) of experiment ", *r.owner[i] + 1) : "(0)");
}

/// σ² (JᵀJ)⁻¹ for the parameters that are not at a bound.
void find_covariance(GreyBoxFit& out, const GreyBoxPoint& at, double accuracy) {
  Mat J = at.J;
  for (const Index i : out.active) J.col(i).setZero();
  out.ls = solve_triangular(pendula::triangular_factor(J, at.e).R(), at.e.size(), accuracy);
}

/// Searches from the guess over the whole record; if the fit is poor, also over growing parts of it.
Found best_of_searches(std::vector<Experiment>& experiments, GreyBoxFit& out, double variation) {
  const GreyBoxRequest& r = out.request;
  constexpr double poor = 0.25;  // of the variation: a fit of 50 %
  const Vec guess = r.bounds.nearest(r.guess);
  std::optional<Found> direct;
  std::string why;
  try {
    direct = search(experiments, r, guess, evaluate(experiments, r, guess));
  } catch (const Failure& failure) {
    why = failure.what();
  }
  if (direct && direct->at.sse <= poor * variation) return *direct;
  std::optional<Found> grown = search_growing(experiments, r);
  if (!direct && !grown) {
    std::vector<std::string> values;
    for (std::size_t i = 0; i < out.names.size(); ++i)
      values.push_back(text(out.names[i], " = ", rounded(guess[i], 4)));
    throw Failure(text("at the guess ", join(values, ", "), " ", why,
                       ". Give guess = { … } at which the model can be integrated"));
  }
  constexpr double better = 0.9;  // less than 10 % lower is the same minimum, or one no better to use
  if (!direct || (grown && grown->at.sse < better * direct->at.sse)) {
    out.grown = true;
    return *grown;
  }
  return *direct;
}

}  // namespace

GreyBoxFit fit(const GreyBoxRequest& given) {
  check(given);
  const GreyBoxRequest request = complete(given);
  GreyBoxFit out;
  out.request = request;
  for (std::size_t i = 0; i < request.parameters.size(); ++i) out.names.push_back(name_of(request, i));
  for (const Expr y : request.outputs) out.output_names.push_back(to_text(y));
  std::vector<Experiment> experiments;
  for (Index k = 0; k < request.data.experiments(); ++k) experiments.emplace_back(request, k);
  const double variation = variation_of(request.data);
  const Found found = best_of_searches(experiments, out, variation);
  out.theta = found.theta;
  out.converged = found.converged;
  out.ending = found.ending;
  out.losses = found.losses;
  out.active = found.active;
  const GreyBoxPoint& at = found.at;
  out.form = experiments[0].form;
  out.method = experiments[0].method;
  const double simulation_error = request.dt > 0 ? fixed_step_rounding : growth * request.rtol;
  find_covariance(out, at, simulation_error);
  for (Index j = 0; j < request.data.outputs(); ++j) {
    std::vector<double> y, e;
    for (Index t = 0; t < request.data.samples(); ++t)
      if (!std::isnan(request.data.y(t, j))) {
        y.push_back(request.data.y(t, j));
        e.push_back(request.data.y(t, j) - at.values(t, j));
      }
    const Vec vy = Eigen::Map<Vec>(y.data(), static_cast<Index>(y.size())),
              ve = Eigen::Map<Vec>(e.data(), vy.size());
    out.fit.push_back(fit_percent(vy, ve));
  }
  out.quality = criteria(at.sse, at.e.size(), out.ls.rank, variation);
  // the error of the integration does not count as noise
  const double size = request.data.y.array().isNaN().select(0, request.data.y).norm();
  out.exact = std::sqrt(at.sse) <= simulation_error * size;
  out.covariance = (out.exact ? 0 : out.quality.sigma2) * out.ls.inverse;
  out.std = standard_deviations(out.ls, out.covariance);
  out.unidentifiable = free_directions(out.ls.null_space, out.names, InParameters::nonlinear);
  for (const Index i : out.active) {
    out.std[i] = 0;
    std::erase_if(out.unidentifiable,
                  [&](const std::string& line) { return line.starts_with(out.names[i] + " is"); });
  }
  out.simulated = at.values;
  out.residuals = at.e;
  dae::ParameterValues values;
  for (std::size_t i = 0; i < request.parameters.size(); ++i)
    if (is_parameter(request.parameters[i])) values[request.parameters[i]] = Expr(out.theta[i]);
  out.fitted = values.empty() ? request.model : dae::with_values(request.model, values);
  return out;
}

void hold(GreyBoxRequest& r, Index held, double value) {
  const Expr p = r.parameters[held];
  if (r.owner[held])
    throw Error(text(to_text(p), " is the initial value of one experiment of several and cannot be held; ",
                     "fit that experiment alone"));
  if (is_parameter(p)) {
    r.start.parameters[p] = Expr(value);
  } else {
    std::erase_if(r.start.fix, [&](const auto& fix) { return fix.first == p; });
    std::erase_if(r.start.guess, [&](const auto& guess) { return guess.first == p; });
    r.start.fix.emplace_back(p, value);
  }
  std::vector<Index> others;
  for (Index i = 0; i < r.guess.size(); ++i)
    if (i != held) others.push_back(i);
  r.parameters.erase(r.parameters.begin() + held);
  r.owner.erase(r.owner.begin() + held);
  if (r.bounds.any()) {
    r.bounds.lower = r.bounds.lower(others).eval();
    r.bounds.upper = r.bounds.upper(others).eval();
  }
  r.guess = r.guess(others).eval();
}

std::string describe(const GreyBoxFit& f) {
  const std::size_t steps = f.losses.size() - 1;
  std::string out =
      text("grey box: ", f.names.size(), f.names.size() == 1 ? " parameter" : " parameters", " from ",
           f.residuals.size(), " samples by Gauss–Newton with exact sensitivities (", steps,
           steps == 1 ? " iteration" : " iterations", f.converged ? ")\n" : "; " + f.ending + ")\n");
  out += text("  simulated with ", f.method, f.form.empty() ? "" : ", model of higher index " + f.form, "\n");
  Table table({false, true, false});
  for (std::size_t i = 0; i < f.names.size(); ++i) {
    const auto k = static_cast<Index>(i);
    table.row({f.names[i], rounded(f.theta[k], f.exact ? 6 : 7),
               std::find(f.active.begin(), f.active.end(), k) != f.active.end() ? "on its bound"
               : !std::isfinite(f.std[k])                                       ? "not identifiable"
               : f.exact                                                        ? ""
                         : "± " + rounded(f.std[k], 4)});
  }
  out += table.str(4);
  if (f.exact)
    out += "  the data are reproduced to the accuracy of the integration\n";
  else
    out += text("  loss V = ", rounded(f.quality.loss, 6), ", noise variance ", rounded(f.quality.sigma2, 6),
                "\n");
  for (std::size_t j = 0; j < f.fit.size(); ++j)
    out += text("  fit of ", f.output_names[j], ": ", rounded(f.fit[j], 6), " % (simulation)\n");
  if (f.grown)
    out +=
        "  found over growing parts of the record; over the whole record the guess leads to another minimum\n";
  if (!f.exact && !f.fit.empty() && *std::min_element(f.fit.begin(), f.fit.end()) < 50)
    out +=
        "  a fit below 50 %: the search ended in another minimum, or the model does not describe the data; try another guess = { … }\n";
  for (const std::string& line : f.unidentifiable) out += "    " + line + "\n";
  if (!f.converged)
    out += "  the search did not converge: give a better guess = { … }, or fewer parameters\n";
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
