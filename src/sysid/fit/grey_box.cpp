#include "sysid/fit/grey_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/least_squares.hpp"
#include "base/text.hpp"
#include "dae/analysis/analysis.hpp"
#include "dae/model/make_model.hpp"
#include "dae/reduce/reduce.hpp"
#include "expr/print/print.hpp"
#include "integrate/run/methods.hpp"
#include "method/collocation.hpp"

namespace pendula::sysid {
namespace {

bool is_parameter(Expr p) { return symbol_of(p).kind == Kind::parameter; }

/// u(t) from samples; before the first and after the last the nearest one.
integrate::Problem::Input sampled(const Vec& u, double from, double Ts, bool hold) {
  return [u, from, Ts, hold](double t) {
    const double s = std::clamp((t - from) / Ts, 0.0, static_cast<double>(u.size() - 1));
    const auto k = std::min<Index>(static_cast<Index>(std::floor(s + 1e-7)), u.size() - 1);
    if (hold || k + 1 >= u.size()) return u[k];
    const double part = std::max(0.0, s - static_cast<double>(k));
    return (1 - part) * u[k] + part * u[k + 1];
  };
}

class Experiment {
 public:
  Experiment(const GreyBoxRequest& r, Index number) : r_(r), number_(number), model_(r.model) {
    const dae::Analysis analysis = dae::analyse(*model_);
    if (analysis.regular && analysis.index > 1) {
      model_ = dae::reduce(model_, "");
      form = model_->name.empty() ? "reduced to index 1" : model_->name;
    }
    first_ = r.data.starts[number];
    for (Index k = first_; k < r.data.end(number); ++k)
      times_.push_back(r.from + static_cast<double>(k - first_) * r.data.Ts);
    const Index rows = r.data.end(number) - first_;
    for (const auto& [leaf, column] : r.inputs)
      inputs_.emplace_back(leaf,
                           sampled(r.data.u.col(column).segment(first_, rows), r.from, r.data.Ts, r.hold));
  }

  Index first() const { return first_; }
  /// Does parameter i belong to this experiment?
  bool owns(std::size_t i) const { return r_.owner.empty() || r_.owner[i] < 0 || r_.owner[i] == number_; }

  /// The start at θ.
  dae::StartRequest start_at(const Vec& theta) const {
    dae::StartRequest start = r_.start;
    start.t = r_.from;
    for (std::size_t i = 0; i < r_.parameters.size(); ++i) {
      if (!owns(i)) continue;
      const Expr p = r_.parameters[i];
      const double value = theta[static_cast<Index>(i)];
      if (is_parameter(p)) {
        start.parameters[p] = Expr(value);
        continue;
      }
      std::erase_if(start.fix, [&](const auto& fix) { return fix.first == p; });
      std::erase_if(start.guess, [&](const auto& guess) { return guess.first == p; });
      start.fix.emplace_back(p, value);
    }
    for (const auto& [leaf, function] : inputs_) {
      start.inputs[leaf] = Expr(function(r_.from));
      start.numeric_inputs.push_back(leaf);
    }
    return start;
  }

  /// States whose initial values the start leaves open, with values to begin with; throws what init says if
  /// that is not what is wrong with it.
  dae::LeafValues open_values(const Vec& theta) const {
    dae::StartRequest start = start_at(theta);
    try {
      dae::init(model_, start);
      return {};
    } catch (const Error&) {
      std::vector<Expr> guessed;
      const auto known = [&](Expr x) {
        for (const auto* list : {&start.fix, &start.guess})
          for (const auto& [leaf, value] : *list)
            if (leaf == x) return true;
        return false;
      };
      for (const Expr x : r_.model->states())
        if (!known(x)) guessed.push_back(x);
      for (const Expr x : guessed) start.guess.emplace_back(x, first_value(r_, x, number_));
      dae::LeafValues open;
      try {
        const dae::ConsistentStatePtr at = dae::init(model_, start);
        for (const dae::LedgerRow& row : at->rows)
          if (row.origin == dae::Origin::chosen &&
              std::find(guessed.begin(), guessed.end(), row.leaf) != guessed.end())
            open.emplace_back(row.leaf, row.value);
      } catch (const UserFacing&) {
      }
      if (open.empty()) throw;
      return open;
    }
  }

  /// Simulates at θ: the rows of this experiment in values (N×ny), and the gradient of all samples of output j in
  /// rows j N … .
  void run(const Vec& theta, Mat& values, Mat& J) {
    poll_interrupt();
    integrate::Simulation s;
    const dae::StartRequest start = start_at(theta);
    for (const auto& [p, value] : start.parameters) s.parameters.try_emplace(p, value);
    s.inputs = r_.start.inputs;
    for (const auto& [leaf, function] : inputs_) s.numeric_inputs.emplace_back(leaf, function);
    s.start = dae::init(model_, start);
    s.plan.from = r_.from;
    s.plan.to = times_.back();
    s.plan.times = times_;
    if (r_.dt > 0) {
      static const auto gauss = std::make_shared<const integrate::Tableau>(integrate::gauss(3));
      s.method = integrate::method_of(gauss);
      s.plan.dt = r_.dt;
    } else {
      s.method = r_.method;
      s.rtol.all = r_.rtol;
      s.atol.all = r_.atol;
    }
    for (std::size_t i = 0; i < r_.parameters.size(); ++i)
      if (owns(i)) s.sensitivities.push_back(r_.parameters[i]);
    const integrate::TrajectoryPtr run = integrate::simulate(model_, s);
    if (run->solution().ending() == integrate::Ending::interrupted) throw Interrupted();
    method = run->solution().method_name();
    if (run->solution().t().size() != times_.size())
      throw Failure(text("the simulation ", run->solution().status()));
    const Mat here = run->values(r_.outputs);
    const Index N = values.rows();
    values.middleRows(first_, here.rows()) = here;
    for (Index i = 0; i < theta.size(); ++i) {
      if (!owns(static_cast<std::size_t>(i))) continue;
      const Mat slope = run->sensitivity(r_.outputs, r_.parameters[i]);
      for (Index j = 0; j < slope.cols(); ++j) J.col(i).segment(j * N + first_, slope.rows()) = slope.col(j);
    }
  }

  std::string form, method;

 private:
  const GreyBoxRequest& r_;
  Index number_, first_ = 0;
  dae::ModelPtr model_;
  std::vector<double> times_;
  std::vector<std::pair<Expr, integrate::Problem::Input>> inputs_;
};

/// Residuals and gradient at the samples that are there.
struct Point {
  Mat values;
  Vec e;
  Mat J;
  double sse = 0;
};

Point evaluate(std::vector<Experiment>& experiments, const GreyBoxRequest& r, const Vec& theta) {
  Point p;
  p.values = Mat::Zero(r.data.samples(), r.data.outputs());
  Mat J = Mat::Zero(p.values.size(), theta.size());
  for (Experiment& experiment : experiments) experiment.run(theta, p.values, J);
  const Vec e = (r.data.y - p.values).reshaped();
  std::vector<Index> rows;
  for (Index i = 0; i < e.size(); ++i)
    if (!std::isnan(r.data.y.reshaped()[i])) rows.push_back(i);
  if (rows.empty()) throw Error("the data have no measured output: all samples of y are missing (NaN)");
  p.e = e(rows);
  p.J = J(rows, Eigen::all);
  p.sse = p.e.squaredNorm();
  if (!p.e.allFinite() || !p.J.allFinite()) throw Failure("the simulation is not finite");
  return p;
}

/// Minimises the squared errors of the simulation from out.theta. Steps at which the model cannot be
/// integrated are refused; V is known to the accuracy of the integration.
void search(std::vector<Experiment>& experiments, const GreyBoxRequest& r, GreyBoxFit& out, Point& at) {
  if (out.theta.size() == 0) {
    out.converged = true;
    out.losses = {at.sse};
    return;
  }
  Vec last = out.theta;
  const auto loss = [&](Vec& theta) -> std::optional<QuadraticModel> {
    theta = r.bounds.nearest(theta);
    try {
      if (last.size() != theta.size() || theta != last) at = evaluate(experiments, r, theta);
      last = theta;
    } catch (const UserFacing&) {
      last.resize(0);
      return {};
    }
    Mat J = -at.J;
    r.bounds.hold(theta, J, at.e);
    return gauss_newton_model(J, at.e);
  };
  MinimiserOptions options;
  options.iterations = r.iterations;
  options.noise = r.dt > 0 ? 1e-12 : std::clamp(10 * r.rtol, 1e-12, 1e-3);
  options.accuracy = r.dt > 0 ? 1e-11 : std::clamp(r.rtol, 1e-11, 1e-4);
  const Minimum m = minimise(loss, out.theta, options);
  out.theta = m.theta;
  out.converged = m.converged();
  out.ending = ending_text(m);
  out.losses.clear();
  for (const double value : m.values) out.losses.push_back(2 * value);
  if (last.size() != m.theta.size() || last != m.theta) at = evaluate(experiments, r, m.theta);
  Mat J = -at.J;
  out.active = r.bounds.hold(m.theta, J, at.e);
}

void check(const GreyBoxRequest& r) {
  if (static_cast<Index>(r.outputs.size()) != r.data.outputs())
    throw Error(text("y names ", r.outputs.size(), " expression(s), but the data has ", r.data.outputs(),
                     " output(s)"));
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

void add_parameter(GreyBoxRequest& r, Expr p, double value, Index owner) {
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

/// Initial values belong to their experiment: those among the parameters, and those that the start leaves open.
GreyBoxRequest complete(const GreyBoxRequest& given) {
  GreyBoxRequest r = given;
  const auto count = given.parameters.size();
  r.owner.assign(count, -1);
  const Index experiments = given.data.experiments();
  for (std::size_t i = 0; i < count && experiments > 1; ++i) {
    if (is_parameter(given.parameters[i])) continue;
    r.owner[i] = 0;
    for (Index k = 1; k < experiments; ++k)
      add_parameter(r, given.parameters[i], first_value(given, given.parameters[i], k), k);
  }
  for (Index k = 0; k < experiments; ++k)
    for (const auto& [state, value] : Experiment(given, k).open_values(given.guess))
      add_parameter(r, state, value, experiments > 1 ? k : -1);
  return r;
}

std::string name_of(const GreyBoxRequest& r, std::size_t i) {
  const Expr p = r.parameters[i];
  if (is_parameter(p)) return to_text(p);
  return to_text(p) + (r.owner[i] < 0 ? "(0)" : text("(0) of experiment ", r.owner[i] + 1));
}

/// σ² (JᵀJ)⁻¹ of what does not rest on a bound.
void find_covariance(GreyBoxFit& out, const Point& at, double accuracy) {
  Mat J = at.J;
  for (const Index i : out.active) J.col(i).setZero();
  out.ls = solve_triangular(pendula::triangular_factor(J, at.e).R(), at.e.size(), accuracy);
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
  out.theta = request.bounds.nearest(request.guess);
  Point at = evaluate(experiments, request, out.theta);
  search(experiments, request, out, at);
  out.form = experiments[0].form;
  out.method = experiments[0].method;
  constexpr double growth = 10;  // of the errors of a simulation over its steps
  find_covariance(out, at, request.dt > 0 ? 1e-9 : growth * request.rtol);
  double variation = 0;
  for (Index j = 0; j < request.data.outputs(); ++j) {
    std::vector<double> y, e;
    for (Index t = 0; t < request.data.samples(); ++t)
      if (!std::isnan(request.data.y(t, j)))
        y.push_back(request.data.y(t, j)), e.push_back(request.data.y(t, j) - at.values(t, j));
    const Vec vy = Eigen::Map<Vec>(y.data(), static_cast<Index>(y.size())),
              ve = Eigen::Map<Vec>(e.data(), vy.size());
    out.fit.push_back(fit_percent(vy, ve));
    variation += (vy.array() - vy.mean()).matrix().squaredNorm();
  }
  out.quality = criteria(at.sse, at.e.size(), out.ls.rank, variation);
  // What the integration leaves is no noise.
  const double size = request.data.y.array().isNaN().select(0, request.data.y).norm();
  out.exact = std::sqrt(at.sse) <= (request.dt > 0 ? 1e-9 : 10 * request.rtol) * (size + 1e-300);
  out.covariance = (out.exact ? 0 : out.quality.sigma2) * out.ls.inverse;
  out.std = standard_deviations(out.ls, out.covariance);
  out.unidentifiable = free_directions(out.ls.null_space, out.names);
  for (const Index i : out.active) {
    out.std[i] = 0;
    std::erase_if(out.unidentifiable,
                  [&](const std::string& line) { return line.starts_with(out.names[i] + " is"); });
  }
  out.simulated = at.values;
  out.residuals = at.e;
  dae::ParameterValues values;
  for (std::size_t i = 0; i < request.parameters.size(); ++i)
    if (is_parameter(request.parameters[i]))
      values[request.parameters[i]] = Expr(out.theta[static_cast<Index>(i)]);
  out.fitted = values.empty() ? request.model : dae::with_values(request.model, values);
  return out;
}

void hold(GreyBoxRequest& r, Index held, double value) {
  const Expr p = r.parameters[held];
  if (r.owner[held] >= 0)
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
  for (const std::string& line : f.unidentifiable) out += "    " + line + "\n";
  if (!f.converged)
    out += "  the search did not converge: give a better guess = { … }, or fewer parameters\n";
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
