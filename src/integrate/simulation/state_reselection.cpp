#include "integrate/simulation/state_reselection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "expr/print/print.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/run_parts.hpp"

namespace pendula::integrate {
namespace {

constexpr double clearly_worse = 0.5;  // quality of the choice in use, relative to the best one
constexpr long most_switches = 100'000;

/// The leaves of a problem, in the order x, x′, z, translated to the model that was reduced.
std::vector<Expr> original_leaves(const dae::Model& model, const Problem& problem) {
  const dae::FirstOrder& form = problem.model();
  std::vector<Expr> list;
  for (Expr x : form.x) list.push_back(dae::original_leaf(model, x));
  for (Expr x : form.x) list.push_back(derivative_leaf(dae::original_leaf(model, x)));
  for (Expr z : form.z) list.push_back(dae::original_leaf(model, z));
  return list;
}

/// Compares the choice in use with the best one at a point of its problem.
class ChoiceMonitor {
 public:
  ChoiceMonitor(const dae::DummyPivoting& pivoting, const dae::ModelPtr& model, dae::DummySelection selection,
                const Simulation& simulation)
      : pivoting_(pivoting), selection_(std::move(selection)), problem_(make_problem(model, simulation)) {
    std::vector<Expr> slopes;
    for (Expr e : pivoting.slopes) slopes.push_back(substitute(dae::resolve(*model, e), simulation.inputs));
    kernel_ = codegen::Kernel(slopes, problem_->arguments());
  }

  /// A clearly better choice, if there is one.
  std::optional<dae::DummySelection> better(const Point& point, double than = clearly_worse) {
    problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
    const std::vector<double> numbers = kernel_(problem_->values());
    try {
      const dae::DummySelection best = pivoting_.best(numbers);
      if (best == selection_ || pivoting_.quality(selection_, numbers) >= than * best.quality) return {};
      return best;
    } catch (const Failure&) {
      return {};  // the constraints themselves are singular here: no choice helps
    }
  }

 private:
  const dae::DummyPivoting& pivoting_;
  dae::DummySelection selection_;
  ProblemPtr problem_;
  codegen::Kernel kernel_;
};

std::string states_text(const dae::Model& model) { return dae::grouped_names(model.states()); }

class StateReselection {
 public:
  StateReselection(const dae::ModelPtr& model, const Simulation& simulation)
      : first_(model),
        simulation_(simulation),
        source_(dae::original(model)),
        shared_pivoting_(dae::shared_pivoting(source_)),
        pivoting_(*shared_pivoting_),
        whole_(model, simulation, original_leaves(*model, *make_problem(model, simulation))) {}

  TrajectoryPtr run() {
    dae::ModelPtr model = first_;
    dae::DummySelection selection = dae::selection_of(*model);
    double t = simulation_.plan.from;
    std::vector<std::pair<Expr, double>> values;  // by original leaf, at the start of the next piece
    RunOutcome outcome{Ending::stop_when, ""};
    if (const auto better = ChoiceMonitor(pivoting_, model, selection, simulation_)
                                .better(start_point(whole_.problem(), simulation_))) {
      for (Expr leaf : original_leaves(*model, whole_.problem()))
        if (const auto value = simulation_.start->value_for(*source_, leaf))
          values.emplace_back(leaf, *value);
      selection = *better;
      model = dae::reduce_dummy(source_, selection);
    }
    for (long k = 0; k < most_switches && outcome.ending == Ending::stop_when; ++k) {
      outcome = piece(model, selection, t, values);
      if (whole_.is_stopped()) return whole_.finish(outcome);
      if (whole_.pieces().last().solution->size() == 0) break;
      const auto next = outcome.ending == Ending::finished ? std::nullopt : next_;
      if (!next) continue;
      if (outcome.ending != Ending::stop_when && t == whole_.pieces().last().solution->t().back())
        break;  // no step was possible
      outcome = {Ending::stop_when, ""};
      selection = *next;
      model = dae::reduce_dummy(source_, selection);
      t = whole_.pieces().last().solution->t().back();
    }
    if (outcome.ending == Ending::stop_when)
      outcome = stopped_at(whole_.pieces().last().solution->t().back(),
                           text("the states were switched ", most_switches, " times"));
    return whole_.finish(outcome);
  }

 private:
  /// Integrates until the choice of states degrades; next_ is the choice to continue with.
  RunOutcome piece(const dae::ModelPtr& model, const dae::DummySelection& selection, double from,
                   std::vector<std::pair<Expr, double>>& values) {
    Simulation part = simulation_;
    part.plan.from = from;
    part.plan.times.reset();
    if (!values.empty()) part.start = start_at(model, from, values);
    part.rtol = whole_.tolerances_in(model, simulation_.rtol);
    part.atol = whole_.tolerances_in(model, simulation_.atol);
    auto monitor = std::make_shared<ChoiceMonitor>(pivoting_, model, selection, simulation_);
    next_.reset();
    part.chosen = ChosenOutside::all;
    part.plan.stop_when = whole_.stop_when(model, [this, monitor](const Point& point) {
      next_ = monitor->better(point);
      return next_.has_value();
    });
    const TrajectoryPtr trajectory = simulate(model, part);
    const SolutionPtr solution(trajectory, &trajectory->solution());
    whole_.solution().add_states({from, states_text(*model)});
    whole_.add({model, solution, from}, simulation_.events.size());
    const std::vector<Expr> leaves = original_leaves(*model, solution->problem());
    const Point end = solution->final();
    if (solution->ending() == Ending::stopped) next_ = monitor->better(end, 0.999);
    values.clear();
    for (std::size_t i = 0; i < leaves.size(); ++i) values.emplace_back(leaves[i], entry_of(end, i));
    return solution->outcome();
  }

  dae::ConsistentStatePtr start_at(const dae::ModelPtr& model, double t,
                                   const std::vector<std::pair<Expr, double>>& values) const {
    auto at = std::make_shared<dae::ConsistentState>();
    at->model = model;
    at->t = t;
    for (const auto& [leaf, value] : values) at->values.try_emplace(dae::resolve(*model, leaf), value);
    return at;
  }

  dae::ModelPtr first_;
  const Simulation& simulation_;
  dae::ModelPtr source_;
  std::shared_ptr<const dae::DummyPivoting> shared_pivoting_;
  const dae::DummyPivoting& pivoting_;
  SolutionInParts whole_;
  std::optional<dae::DummySelection> next_;
};

}  // namespace

bool chooses_states(const dae::Model& model) { return model.form == "dummy"; }

TrajectoryPtr simulate_reselecting(const dae::ModelPtr& model, const Simulation& simulation) {
  return StateReselection(model, simulation).run();
}

}  // namespace pendula::integrate
