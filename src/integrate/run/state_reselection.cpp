#include "integrate/run/state_reselection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "expr/print/print.hpp"
#include "integrate/run/problem_setup.hpp"

namespace pendula::integrate {
namespace {

constexpr double clearly_worse = 0.5;  // quality of the choice in use, relative to the best one
constexpr long most_switches = 100'000;

/// The leaves of a problem, in the order x, x′, z, as leaves of the model that was reduced.
std::vector<Expr> original_leaves(const dae::Model& model, const Problem& problem) {
  const dae::FirstOrder& form = problem.model();
  std::vector<Expr> list;
  for (Expr x : form.x) list.push_back(dae::original_leaf(model, x));
  for (Expr x : form.x) list.push_back(derivative_leaf(dae::original_leaf(model, x)));
  for (Expr z : form.z) list.push_back(dae::original_leaf(model, z));
  return list;
}

Point point_of(double t, const Vec& values, int n) {
  return {t, values.head(n), values.segment(n, n), values.tail(values.size() - 2 * n)};
}

/// A part of the trajectory with one choice of states.
struct Piece {
  dae::ModelPtr model;
  dae::DummySelection selection;
  SolutionPtr solution;
  double from = 0;
};

/// One solution made of pieces: times between saved points are asked of the piece they belong to.
class Pieces : public Continuation {
 public:
  Pieces(dae::ModelPtr model, const Problem& problem, const Substitution& inputs)
      : n_(problem.n()), leaves_(original_leaves(*model, problem)), inputs_(inputs) {}

  void add(Piece piece) {
    std::vector<Expr> own;
    for (Expr leaf : leaves_) own.push_back(substitute(dae::resolve(*piece.model, leaf), inputs_));
    expressions_.push_back(std::move(own));
    pieces_.push_back(std::move(piece));
  }
  const Piece& last() const { return pieces_.back(); }

  /// A point of the last piece in the unknowns of the first model.
  Point translated(const Point& point) const {
    return point_of(point.t, last().solution->values(expressions_.back(), point), n_);
  }

  std::pair<double, double> interval(const Points& saved) const override {
    if (pieces_.empty()) return Continuation::interval(saved);
    return {pieces_.front().solution->t().front(), pieces_.back().solution->t().back()};
  }

  Point at(const Points&, double t) override {
    std::size_t k = pieces_.size() - 1;
    while (k > 0 && pieces_[k].from > t) --k;
    return point_of(t, pieces_[k].solution->values(expressions_[k], t), n_);
  }

 private:
  int n_;
  std::vector<Expr> leaves_;
  Substitution inputs_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<Expr>> expressions_;
};

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
    problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
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
        pivoting_(source_),
        problem_(make_problem(model, simulation)),
        pieces_(std::make_shared<Pieces>(model, *problem_, simulation.inputs)),
        merged_(std::make_shared<Solution>(problem_)) {
    if (simulation_.plan.times) times_ = *simulation_.plan.times;
  }

  TrajectoryPtr run() {
    dae::ModelPtr model = first_;
    dae::DummySelection selection = dae::selection_of(*model);
    double t = simulation_.plan.from;
    std::vector<std::pair<Expr, double>> values;  // of original leaves, where the next piece begins
    RunOutcome outcome{Ending::stop_when, ""};
    if (const auto better = ChoiceMonitor(pivoting_, model, selection, simulation_).better(beginning())) {
      for (Expr leaf : original_leaves(*model, *problem_))
        if (const auto value = simulation_.start->value_for(*source_, leaf))
          values.emplace_back(leaf, *value);
      selection = *better;
      model = dae::reduce_dummy(source_, selection);
    }
    bool first = true;
    for (long k = 0; k < most_switches && outcome.ending == Ending::stop_when; ++k) {
      outcome = piece(model, selection, t, values, std::exchange(first, false));
      if (pieces_->last().solution->size() == 0) break;
      const auto next = outcome.ending == Ending::finished ? std::nullopt : next_;
      if (!next) continue;
      if (outcome.ending != Ending::stop_when && t == pieces_->last().solution->t().back())
        break;  // no step was possible
      outcome = {Ending::stop_when, ""};
      selection = *next;
      model = dae::reduce_dummy(source_, selection);
      t = pieces_->last().solution->t().back();
    }
    finish(outcome);
    return std::make_shared<const Trajectory>(first_, simulation_.inputs, merged_, simulation_.events);
  }

 private:
  /// Integrates until the choice of states degrades; what to go on with is in next_.
  RunOutcome piece(const dae::ModelPtr& model, const dae::DummySelection& selection, double from,
                   std::vector<std::pair<Expr, double>>& values, bool first) {
    Simulation part = simulation_;
    part.plan.from = from;
    part.plan.times.reset();
    if (!values.empty()) part.start = start_at(model, from, values);
    auto monitor = std::make_shared<ChoiceMonitor>(pivoting_, model, selection, simulation_);
    next_.reset();
    part.plan.stop_when = [this, monitor](const Point& point) {
      next_ = monitor->better(point);
      return next_.has_value();
    };
    const TrajectoryPtr trajectory = simulate(model, part);
    const SolutionPtr solution(trajectory, &trajectory->solution());
    pieces_->add({model, selection, solution, from});
    merged_->add_states({from, states_text(*model)});
    keep(*solution, first);
    const std::vector<Expr> leaves = original_leaves(*model, solution->problem());
    const Point end = solution->final();
    if (solution->ending() == Ending::stopped) next_ = monitor->better(end, 0.999);
    values.clear();
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const auto n = static_cast<std::size_t>(solution->problem().n());
      const auto k = static_cast<Eigen::Index>(i < n ? i : i < 2 * n ? i - n : i - 2 * n);
      values.emplace_back(leaves[i], i < n ? end.x[k] : i < 2 * n ? end.xdot[k] : end.z[k]);
    }
    return solution->outcome();
  }

  /// Where the first model begins.
  Point beginning() const {
    const dae::FirstOrder& form = problem_->model();
    const auto values = [&](const std::vector<Expr>& list) {
      Vec v = Vec::Zero(static_cast<Eigen::Index>(list.size()));
      for (std::size_t i = 0; i < list.size(); ++i)
        if (const auto it = simulation_.start->values.find(list[i]); it != simulation_.start->values.end())
          v[static_cast<Eigen::Index>(i)] = it->second;
      return v;
    };
    return {simulation_.plan.from, values(form.x), values(form.xdot), values(form.z)};
  }

  dae::ConsistentStatePtr start_at(const dae::ModelPtr& model, double t,
                                   const std::vector<std::pair<Expr, double>>& values) const {
    auto at = std::make_shared<dae::ConsistentState>();
    at->model = model;
    at->t = t;
    for (const auto& [leaf, value] : values) at->values.try_emplace(dae::resolve(*model, leaf), value);
    return at;
  }

  void keep(const Solution& solution, bool first) {
    for (int i = first ? 0 : 1; !simulation_.plan.times && i < solution.size(); ++i)
      merged_->save(pieces_->translated(solution.point(i)));
    const double end = solution.t().back(), rounding = 1e-14 * (1 + std::fabs(end));
    for (; next_time_ < times_.size() && times_[next_time_] <= end + rounding; ++next_time_) {
      Point point = pieces_->translated(solution.at(std::min(times_[next_time_], end)));
      point.t = times_[next_time_];
      merged_->save(point);
    }
    for (EventRecord event : solution.events()) {
      event.before = pieces_->translated(event.before);
      event.after = pieces_->translated(event.after);
      merged_->add_event(event);
    }
    const Stats& s = solution.stats();
    stats_.steps += s.steps;
    stats_.rejected += s.rejected;
    stats_.evaluations += s.evaluations;
    stats_.jacobians += s.jacobians;
    stats_.factorisations += s.factorisations;
    stats_.newton_iterations += s.newton_iterations;
    seconds_ += solution.cpu_seconds();
  }

  void finish(const RunOutcome& outcome) {
    const Solution& last = *pieces_->last().solution;
    merged_->set_method(last.method_name(), last.dt());
    merged_->set_continuation(pieces_);
    const bool endless = outcome.ending == Ending::stop_when;
    merged_->finish(
        endless ? stopped_at(last.t().back(), text("the states were switched ", most_switches, " times"))
                : outcome,
        stats_, seconds_);
  }

  dae::ModelPtr first_;
  const Simulation& simulation_;
  dae::ModelPtr source_;
  dae::DummyPivoting pivoting_;
  ProblemPtr problem_;
  std::shared_ptr<Pieces> pieces_;
  std::shared_ptr<Solution> merged_;
  std::vector<double> times_;
  std::size_t next_time_ = 0;
  std::optional<dae::DummySelection> next_;
  Stats stats_;
  double seconds_ = 0;
};

}  // namespace

bool chooses_states(const dae::Model& model) { return model.form == "dummy"; }

TrajectoryPtr simulate_reselecting(const dae::ModelPtr& model, const Simulation& simulation) {
  return StateReselection(model, simulation).run();
}

}  // namespace pendula::integrate
