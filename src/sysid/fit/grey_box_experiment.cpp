#include "sysid/fit/grey_box_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/analysis/analysis.hpp"
#include "dae/reduce/reduce.hpp"
#include "integrate/run/methods.hpp"
#include "method/collocation.hpp"

namespace pendula::sysid {

/// u(t) from samples at from + k Ts, with these times exact to the last digit: steps end there, with the
/// value from the left. Outside the record the nearest sample holds.
static integrate::Problem::Input sampled(const Vec& u, double from, double Ts, bool hold) {
  return [u, from, Ts, hold](double t) {
    const auto time = [&](Index k) { return from + static_cast<double>(k) * Ts; };
    const double s = std::clamp((t - from) / Ts, 0.0, static_cast<double>(u.size() - 1));
    auto k = static_cast<Index>(std::floor(s));
    while (k + 1 < u.size() && time(k + 1) <= t) ++k;
    while (k > 0 && time(k) > t) --k;
    if (hold || k + 1 >= u.size()) return u[k];
    const double part = std::clamp(s - static_cast<double>(k), 0.0, 1.0);
    return (1 - part) * u[k] + part * u[k + 1];
  };
}

Experiment::Experiment(const GreyBoxRequest& r, Index number) : r_(r), number_(number), model_(r.model) {
  const dae::Analysis analysis = dae::analyse(*model_);
  if (analysis.regular && analysis.index > 1) {
    model_ = dae::reduce(model_, "");
    form = model_->name.empty() ? "reduced to index 1" : model_->name;
  }
  first_ = r.data.starts[number];
  shorten(1);
  const Index rows = r.data.end(number) - first_;
  for (const auto& [leaf, column] : r.inputs)
    inputs_.emplace_back(leaf,
                         sampled(r.data.u.col(column).segment(first_, rows), r.from, r.data.Ts, r.hold));
}

void Experiment::shorten(double share) {
  const Index rows = r_.data.end(number_) - first_;
  const auto used = static_cast<Index>(std::ceil(share * static_cast<double>(rows)));
  times_.clear();
  for (Index k = 0; k < std::clamp<Index>(used, std::min<Index>(2, rows), rows); ++k)
    times_.push_back(r_.from + static_cast<double>(k) * r_.data.Ts);
}

/// The start for parameters θ.
dae::StartRequest Experiment::start_at(const Vec& theta) const {
  dae::StartRequest start = r_.start;
  start.t = r_.from;
  for (std::size_t i = 0; i < r_.parameters.size(); ++i) {
    if (!owns(i)) continue;
    const Expr p = r_.parameters[i];
    const double value = theta[i];
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

dae::LeafValues Experiment::open_values(const Vec& theta) const {
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

integrate::Simulation Experiment::simulation_at(const Vec& theta) const {
  integrate::Simulation s;
  const dae::StartRequest start = start_at(theta);
  for (const auto& [p, value] : start.parameters) s.parameters.try_emplace(p, value);
  s.inputs = r_.start.inputs;
  for (const auto& [leaf, function] : inputs_) s.numeric_inputs.emplace_back(leaf, function);
  s.start = dae::init(model_, start);
  s.plan.from = r_.from;
  s.plan.to = times_.back();
  s.plan.times = times_;
  if (r_.hold && !inputs_.empty()) s.plan.breaks = times_;
  for (const dae::Transition& own : model_->events) s.events.push_back({own, {}});
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
  return s;
}

void Experiment::run(const Vec& theta, Mat& values, Mat& J) {
  poll_interrupt();
  const integrate::TrajectoryPtr run = integrate::simulate(model_, simulation_at(theta));
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

bool is_piecewise(const dae::Model& model) {
  const std::vector<Expr> nodes = topological(model.residuals);
  return !model.events.empty() || std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    return node.op() == Op::ifelse || node.op() == Op::abs || node.op() == Op::sign || node.op() == Op::min ||
           node.op() == Op::max;
  });
}

GreyBoxPoint evaluate(std::vector<Experiment>& experiments, const GreyBoxRequest& r, const Vec& theta) {
  GreyBoxPoint p;
  p.values = Mat::Zero(r.data.samples(), r.data.outputs());
  Mat J = Mat::Zero(p.values.size(), theta.size());
  for (Experiment& experiment : experiments) experiment.run(theta, p.values, J);
  const Vec e = (r.data.y - p.values).reshaped();
  std::vector<Index> rows;
  const Index samples = r.data.samples();
  for (Index i = 0; i < e.size(); ++i) {
    const bool counts = std::any_of(experiments.begin(), experiments.end(),
                                    [&](const Experiment& x) { return x.covers(i % samples); });
    if (counts && !std::isnan(r.data.y.reshaped()[i])) rows.push_back(i);
  }
  if (rows.empty()) throw Error("the data have no measured output: all samples of y are missing (NaN)");
  p.e = e(rows);
  p.J = J(rows, Eigen::all);
  p.sse = p.e.squaredNorm();
  if (!p.e.allFinite() || !p.J.allFinite()) throw Failure("the simulation is not finite");
  return p;
}

}  // namespace pendula::sysid
