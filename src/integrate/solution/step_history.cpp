#include "integrate/solution/step_history.hpp"

#include <cmath>
#include <optional>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

void StepHistory::use(std::shared_ptr<Stepper> stepper) {
  if (!steppers_.empty()) stepper->copy_position(*steppers_.back());
  steppers_.push_back(std::move(stepper));
}

void StepHistory::use_modes(const ProblemPtr& problem, const std::vector<double>& modes) {
  problem->set_modes(modes);
  const Modes now{problem, modes};
  if (modes_.empty() || !(modes_.back() == now)) modes_.push_back(now);
}

void StepHistory::forget_if_large() {
  constexpr std::size_t most = 4'000'000;  // numbers
  if (!may_forget_ || forgotten_ || mesh_.numbers() + records_.size() < most) return;
  forgotten_ = true;
  mesh_ = Points(mesh_.n(), mesh_.m());
  steps_ = {};
  records_ = {};
}

void StepHistory::begin(const Point& point) {
  if (forgotten_) return;
  mesh_.add(point);
  steps_.push_back({0, Step::none, Step::none});
}

void StepHistory::step_to(const Point& point, const std::vector<double>& record) {
  forget_if_large();
  if (forgotten_) return;
  mesh_.add(point);
  steps_.push_back(
      {records_.size(), static_cast<int>(steppers_.size()) - 1, static_cast<int>(modes_.size()) - 1});
  records_.insert(records_.end(), record.begin(), record.end());
}

std::vector<DiscreteStep> StepHistory::steps() {
  if (forgotten_)
    throw Error(
        "the adjoint needs every step of the solution, and this long run kept only the points at its "
        "times = { … }; integrate without times");
  std::vector<DiscreteStep> result;
  StepView view;
  Vec before;  // x′ at the end of the last step
  for (int i = 1; i < mesh_.size(); ++i) {
    const Step& step = steps_[i];
    mesh_.get(i - 1, view.from);
    mesh_.get(i, view.to);
    if (step.is_jump()) {
      if (view.to.x != view.from.x)
        throw Error(text("the adjoint does not follow the reset at t = ", rounded(view.to.t, 6),
                         "; integrate with sensitivities = { … }"));
      continue;
    }
    view.record = records_.data() + step.record;
    const Stepper& stepper = *steppers_[step.stepper];
    DiscreteStep taken{view.from, view.to.t, stepper.tableau(view), {}};
    if (!taken.tableau)
      throw Error(
          text("the adjoint needs a Runge–Kutta method such as \"dopri5\" or \"radau\", the solution is by ",
               stepper.name(), "; or integrate with sensitivities = { … }"));
    if (step.has_modes()) taken.modes = modes_[step.modes].values;
    if (step.has_modes() && modes_[step.modes].problem != modes_[0].problem)
      throw Error(text("the adjoint does not follow branches that change inside a step, as they do from t = ",
                       rounded(view.from.t, 6), " on; integrate with sensitivities = { … }"));
    const Vec jump = result.empty() ? Vec() : Vec(view.from.xdot - before);
    if (!result.empty() && result.back().modes != taken.modes && jump.norm() > 1e-6 * view.from.xdot.norm())
      throw Error(text("x′ jumps at t = ", rounded(view.from.t, 6), " where the equations switch, which the ",
                       "adjoint does not follow; integrate with sensitivities = { … }"));
    before = view.to.xdot;
    result.push_back(std::move(taken));
  }
  return result;
}

bool StepHistory::interpolate(double t, Point& out) {
  if (forgotten_) return false;
  const int i = std::min(mesh_.index_at(t, 0), mesh_.size() - 1);
  mesh_.get(i, out);
  if (i + 1 >= mesh_.size() || t <= out.t) return true;
  const Step& step = steps_[i + 1];
  if (step.is_jump()) return true;
  StepView view;
  mesh_.get(i, view.from);
  mesh_.get(i + 1, view.to);
  view.record = records_.data() + step.record;
  steppers_[step.stepper]->interpolate(view, t, Detail::state, out);
  const double s = (t - view.from.t) / (view.to.t - view.from.t);
  out.t = t;
  out.xdot = (1 - s) * view.from.xdot + s * view.to.xdot;
  out.z = (1 - s) * view.from.z + s * view.to.z;
  return true;
}

bool StepHistory::interpolate_roughly(double t, Point& out) {
  if (forgotten_) return false;
  const int i = std::min(mesh_.index_at(t, 0), mesh_.size() - 1);
  mesh_.get(i, out);
  if (i + 1 >= mesh_.size() || t <= out.t) return true;
  const Point from = out;
  Point to;
  mesh_.get(i + 1, to);
  hermite(from, to, (t - from.t) / (to.t - from.t), out);
  return true;
}

double StepHistory::cut(double t) {
  mesh_.cut(t);
  while (steps_.size() > static_cast<std::size_t>(mesh_.size())) {
    if (!steps_.back().is_jump()) records_.resize(steps_.back().record);
    steps_.pop_back();
  }
  viewed_.reset();
  return mesh_.t().back();
}

/// A requested point.
static Point saved_at(const Points& saved, double t) {
  const double rounding = 4 * std::numeric_limits<double>::epsilon() *
                          std::max(std::fabs(saved.t().front()), std::fabs(saved.t().back()));
  const int i = saved.index_at(t, rounding);
  if (std::fabs(t - saved.t()[i]) <= rounding) return saved[i];
  throw Error(text("t = ", rounded(t, 6),
                   " is not one of the times that were saved, and the steps of this long run were not kept "
                   "(they take too much memory); add it to times = { … }"));
}

/// ask(stepper, step) for the step that begins at a mesh point, in its modes.
template <class Ask>
auto StepHistory::of_step(int mesh_point, const Ask& ask) {
  const Step& step = steps_[mesh_point + 1];
  StepView view;
  mesh_.get(mesh_point, view.from);
  mesh_.get(mesh_point + 1, view.to);
  view.record = records_.data() + step.record;
  if (step.has_modes()) modes_[step.modes].problem->set_modes(modes_[step.modes].values);
  const auto answer = ask(*steppers_[step.stepper], view);
  if (step.has_modes()) modes_.back().problem->set_modes(modes_.back().values);
  return answer;
}

double StepHistory::errors_beyond_estimates() {
  if (forgotten_) return 0;
  double sum = 0;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
    for (const DoubtfulStep& step : steppers_[k]->doubtful_steps()) {
      poll_interrupt();
      const int i = mesh_.index_at(step.t, 0);  // not there if the step was taken back
      if (i + 1 >= mesh_.size() || mesh_.t()[i] != step.t) continue;
      if (steps_[i + 1].stepper != static_cast<int>(k)) continue;
      const double error =
          of_step(i, [](Stepper& stepper, const StepView& view) { return stepper.error_by_doubling(view); });
      sum += std::max(0.0, error - step.estimate);
      if (sum > Stats::many_errors) return sum;
    }
  return sum;
}

std::optional<double> StepHistory::passed_growth() {
  constexpr int most = 3000;  // steps: a tenth of a second
  if (forgotten_ || mesh_.size() > most) return {};
  for (int i = 0; i + 1 < mesh_.size(); ++i) {
    poll_interrupt();
    const Step& step = steps_[i + 1];
    if (step.is_jump() || steppers_[step.stepper]->is_explicit()) continue;
    if (of_step(i, [](Stepper& own, const StepView& view) { return own.passes_growth(view); }))
      return mesh_.t()[i];
  }
  return {};
}

Point StepHistory::at(const Points& saved, double t) {
  if (forgotten_) return saved_at(saved, t);
  const double rounding = 4 * std::numeric_limits<double>::epsilon() *
                          std::max(std::fabs(mesh_.t().front()), std::fabs(mesh_.t().back()));
  const int i = mesh_.index_at(t, rounding);
  if (std::fabs(t - mesh_.t()[i]) <= rounding || i + 1 >= mesh_.size()) return mesh_[i];
  const Step& step = steps_[i + 1];
  if (step.is_jump()) return mesh_[i];
  if (viewed_ != i) {
    mesh_.get(i, view_.from);
    mesh_.get(i + 1, view_.to);
    viewed_ = i;
  }
  view_.record = records_.data() + step.record;
  if (step.has_modes()) modes_[step.modes].problem->set_modes(modes_[step.modes].values);
  Point out;
  steppers_[step.stepper]->look(view_, t, Detail::full, out);
  // the run may still be in progress
  if (step.has_modes()) modes_.back().problem->set_modes(modes_.back().values);
  return out;
}

}  // namespace pendula::integrate
