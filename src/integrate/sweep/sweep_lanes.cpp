#include "integrate/sweep/sweep_lanes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/monitor/peak_monitor.hpp"
#include "integrate/event/monitor/switch_monitor.hpp"
#include "integrate/problem/invariant_zeros.hpp"
#include "integrate/run/adaptive_run.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/state_reselection.hpp"
#include "integrate/solution/regrowth.hpp"
#include "integrate/sweep/pole_signs.hpp"

namespace pendula::integrate {
namespace {

/// The request for the start of a run.
dae::StartRequest start_request(const SweepRequest& request, const SweepSet& set) {
  dae::StartRequest start = (set.at ? set.at : request.simulation.start)->request;
  for (const auto& [p, value] : set.parameters) start.parameters[p] = Expr(value);
  for (const auto& [leaf, value] : set.start) {
    std::erase_if(start.fix, [&, wanted = leaf](const auto& fix) { return fix.first == wanted; });
    start.fix.emplace_back(leaf, value);
  }
  return start;
}

/// An objection to lanes that follows from the request alone.
std::string objection(const SweepRequest& request) {
  const Simulation& s = request.simulation;
  const int runs = request.runs;
  if (request.lanes == 1) return "lanes = 1 was asked for";
  if (codegen::Machine::widest() == 1) return "no SIMD code for this processor";
  if (request.lanes == 0 && runs < codegen::Machine::widest())
    return text(runs, runs == 1 ? " run does" : " runs do", " not fill the ", codegen::Machine::widest(),
                " lanes");
  if (s.plan.dt) return "the steps are fixed";
  if (!s.sensitivities.empty()) return "sensitivities are asked for";
  if (!s.events.empty()) return "events are watched for";
  if (!s.plan.breaks.empty() || !s.plan.monitored_inputs.empty()) return "inputs jump";
  if (!s.numeric_inputs.empty()) return "inputs are functions of numbers";
  if (chooses_states(*request.model)) return "the form chooses its states on the way";
  if (s.method.family && !s.method.family->is_explicit)
    return text("the method ", name_of(s.method), " is implicit");
  return "";
}

/// An objection that follows from the equations.
std::string objection(const Problem& problem, const Plan& plan) {
  if (!problem.is_ode() || problem.m() > 0) return "the model is not an explicit ODE x′ = f(t, x)";
  if (problem.n() == 0) return "the model has no states";
  const auto& events = plan.events.list;
  if (std::any_of(events.begin(), events.end(), [](const Event& event) { return event.surface; }))
    return "the equations switch (abs, sign, ifelse, …)";
  if (!plan.breaks.empty()) return "the equations contain short pulses in time";
  if (problem.projects()) return "the form projects onto constraints";
  if (!problem.model().u.empty()) return "inputs are functions of numbers";
  return "";
}

/// One run of the sweep, set up to the choice of its method.
struct Probe {
  ProblemSetup run;
  Plan plan;
  Choice choice;
};

std::optional<Probe> probe(const SweepRequest& request, int number) {
  const SweepSet set = request.set(number);
  Simulation simulation = request.simulation;
  simulation.many_parameters = true;
  try {
    for (const auto& [p, value] : set.parameters) simulation.parameters[p] = Expr(value);
    simulation.start = dae::init(request.model, start_request(request, set));
    require_low_index(*request.model, simulation.plan.direct);
    Probe result{set_up_problem(request.model, simulation), simulation.plan, {}};
    complete_plan(result.plan, request.model, simulation, result.run, std::make_shared<TrajectoryPtr>());
    check_adaptive(result.plan);
    const Point start = checked_start(result.run.start, *result.run.problem, result.plan.from);
    result.choice = simulation.method.family
                        ? Choice{simulation.method.family, simulation.method.tableau, ""}
                        : choose(result.run.problem, simulation.method, result.plan, start);
    return result;
  } catch (const UserFacing&) {
    return {};  // the run itself will report it
  }
}

}  // namespace

std::shared_ptr<const LaneSweep> LaneSweep::make(const SweepRequest& request,
                                                 const std::vector<Expr>& arguments, std::string& why) {
  why = objection(request);
  if (!why.empty()) return nullptr;
  const int runs = request.runs;
  std::optional<Probe> found;
  for (int number : {0, runs / 2, runs - 1}) {
    auto one = probe(request, number);
    if (!one) continue;
    found = std::move(one);
    if (found->choice.family->is_explicit) break;
  }
  why = "no run could be started";
  if (!found) return nullptr;
  const Problem& problem = *found->run.problem;
  why = objection(problem, found->plan);
  if (!why.empty()) return nullptr;
  why = "the equations cannot be solved everywhere, which is monitored step by step";
  if (!guards_of(request.model, request.simulation.inputs, problem, false).empty()) return nullptr;
  if (!blocks_of(request.model, request.simulation.inputs, problem).empty()) return nullptr;
  why = text("the method is ", found->choice.family->name, ": ", found->choice.why);
  if (!found->choice.family->is_explicit) return nullptr;
  const Tableau& rk = *found->choice.tableau;
  why = text(rk.name(), " has no embedded method");
  if (!rk.bhat()) return nullptr;
  int lanes = request.lanes == 0 ? codegen::Machine::widest() : request.lanes;
  if (!codegen::Machine::available(lanes)) lanes = codegen::Machine::widest();
  why = "no machine code can be made here";
  if (!codegen::Machine::available(lanes)) return nullptr;
  auto sweep = std::make_shared<LaneSweep>();
  sweep->code_ = CompiledLaneStep::make(problem, rk, !request.simulation.method.family, lanes);
  why = "the equations are long";
  if (!sweep->code_) return nullptr;
  why = "a leaf is not known to the equations";
  if (!sweep->map_arguments(problem, arguments)) return nullptr;
  sweep->request_ = &request;
  sweep->map_sets(problem);
  sweep->method_ = rk.name();
  const Plan& plan = found->plan;
  sweep->plan_ = {plan.from,
                  plan.to,
                  plan.dt_first,
                  plan.dt_max,
                  static_cast<double>(plan.most_steps),
                  {},
                  plan.tolerances.rtol,
                  plan.tolerances.atol,
                  rk.stages() - (rk.is_fsal() ? 1 : 0)};
  why = "";
  return sweep;
}

bool LaneSweep::map_arguments(const Problem& problem, const std::vector<Expr>& arguments) {
  const dae::FirstOrder& form = problem.model();
  for (Expr leaf : arguments) {
    const auto place = [&](const std::vector<Expr>& list) {
      const auto at = std::find(list.begin(), list.end(), leaf);
      return at == list.end() ? std::optional<int>() : static_cast<int>(at - list.begin());
    };
    if (leaf == time_symbol()) {
      stored_.emplace_back(Source::time, 0);
    } else if (const auto i = place(form.x)) {
      stored_.emplace_back(Source::x, *i);
    } else if (const auto k = place(form.xdot)) {
      stored_.emplace_back(Source::xdot, *k);
    } else if (const auto j = place(form.p)) {
      stored_.emplace_back(Source::p, *j);
    } else {
      return false;
    }
  }
  return true;
}

void LaneSweep::map_sets(const Problem& problem) {
  problem_ = std::make_shared<Problem>(problem);
  const dae::FirstOrder& form = problem.model();
  form_ = std::make_shared<const dae::FirstOrder>(form);
  parameters_.assign(problem.values().end() - static_cast<std::ptrdiff_t>(form.p.size()),
                     problem.values().end());
  for (std::size_t j = 0; j < form.p.size(); ++j) p_.emplace_back(form.p[j], static_cast<int>(j));
  x_ = form.x;
  // A start that fixes exactly the states of an unreduced model needs no solution of equations.
  const auto plain = [&](const dae::StartRequest& start) {
    return start.fix.size() == x_.size() && std::all_of(x_.begin(), x_.end(), [&](Expr x) {
             return std::any_of(start.fix.begin(), start.fix.end(),
                                [&](const auto& f) { return f.first == x && std::isfinite(f.second); });
           });
  };
  plain_start_ = dae::original(request_->model) == request_->model && request_->model->invariants.empty() &&
                 !request_->own_starts && plain(start_request(*request_, request_->set(0)));
}

/// Supplies the sets of one worker.
class LaneSweep::Client : public EnsembleClient {
 public:
  Client(const LaneSweep& sweep, SharedSlots& slots, TaskQueue& queue, int most,
         const std::function<void(int)>& progress)
      : sweep_(sweep), slots_(slots), queue_(queue), left_(most), progress_(progress), poles_(*sweep.form_) {
    const Tolerances tolerances{sweep.plan_.rtol, sweep.plan_.atol};
    for (int l = 0; l < sweep.lanes(); ++l) {
      watches_.push_back({PeakMonitor(*sweep.problem_, tolerances, true), SwitchMonitor(*sweep.problem_),
                          RegrowthWatch(single_zeros(*sweep.problem_), tolerances,
                                        std::vector<char>(sweep.x_.size(), 1), true)});
      if (watches_.front().is_empty()) break;
    }
    base_.assign(sweep.x_.size(), 0);
    if (sweep.plain_start_)
      for (const auto& [leaf, value] : sweep.request_->simulation.start->request.fix)
        put(base_.data(), leaf, value);
  }

  std::optional<int> next(double* x, double* p) override {
    while (left_ > 0) {
      const auto run = queue_.next();
      if (!run) return {};
      --left_;
      claimed_.push_back(*run);
      if (!begin(sweep_.request_->set(slots_.run(*run)), *run, x, p)) continue;
      poles_.start(*run, sweep_.plan_.from, x, p);
      return run;
    }
    return {};
  }
  void point(int run, std::optional<int> place, double t, const double* x, const double* xdot,
             const double* p) override {
    double* to = slots_.numbers(run) + store::Record::head +
                 sweep_.stored_.size() * (place ? static_cast<std::size_t>(*place) + 1 : 0);  // the end first
    for (const auto& [source, k] : sweep_.stored_)
      *to++ = source == Source::time   ? t
              : source == Source::x    ? x[k]
              : source == Source::xdot ? xdot[k]
                                       : p[k];
    if (!place) slots_.numbers(run)[0] = t;
    poles_.update(run, t, x, p);
  }
  void finished(int run, const Stats& stats) override {
    double* numbers = slots_.numbers(run);
    numbers[1] = static_cast<double>(stats.steps);
    numbers[2] = static_cast<double>(stats.rejected);
    numbers[3] = static_cast<double>(stats.evaluations);
    end(run, poles_.changed(run) ? SharedSlots::State::apart : SharedSlots::State::done);
  }
  void abandoned(int run) override {
    poles_.changed(run);
    end(run, SharedSlots::State::apart);
  }
  bool watches_steps() const override { return !watches_.front().is_empty(); }
  /// Rejects a step that has missed a peak or a narrow switch, or behind which a state has grown again from
  /// below its tolerance; the set is then run on its own.
  bool rejects(int lane, int run, const Point& from, const Point& to, const double* p) override {
    LaneWatch& watch = watches_[lane];
    if (watch.run != run) {
      watch.run = run;
      if (!watch.problem) watch.problem = std::make_shared<Problem>(*sweep_.problem_);
      watch.problem->set_numbers(Eigen::Map<const Vec>(p, static_cast<Eigen::Index>(sweep_.p_.size())), {});
      watch.peaks.restart(watch.problem, from);
      watch.regrowth.restart(watch.problem, from);
    }
    return watch.switches.after(watch.problem, from, to) || watch.peaks.after(watch.problem, from, to) ||
           watch.regrowth.ends_run(from, to, ignored_);
  }
  /// Returns the sets that this worker has not finished.
  void give_back() {
    for (int run : claimed_) slots_.set(run, SharedSlots::State::waiting);
    claimed_.clear();
  }

 private:
  /// Of the invariant zeros those of one state; larger sets, as of the Lorenz equations, would cost every
  /// step of every lane a look.
  static std::vector<std::vector<int>> single_zeros(const Problem& problem) {
    std::vector<std::vector<int>> sets = invariant_zeros(problem);
    std::erase_if(sets, [](const std::vector<int>& set) { return set.size() > 1; });
    return sets;
  }
  void put(double* x, Expr leaf, double value) const {
    const auto at = std::find(sweep_.x_.begin(), sweep_.x_.end(), leaf);
    if (at != sweep_.x_.end()) x[at - sweep_.x_.begin()] = value;
  }
  /// Prepares the start of a set; false if that fails, with the reason in the slot.
  bool begin(const SweepSet& set, int run, double* x, double* p) {
    std::copy(sweep_.parameters_.begin(), sweep_.parameters_.end(), p);
    for (const auto& [leaf, value] : set.parameters)
      for (const auto& [known, number] : sweep_.p_)
        if (known == leaf) p[number] = value;
    if (sweep_.plain_start_) {
      std::copy(base_.begin(), base_.end(), x);
      for (const auto& [leaf, value] : set.start) put(x, leaf, value);
      return true;
    }
    poll_interrupt();
    try {
      const auto start = dae::init(sweep_.request_->model, start_request(*sweep_.request_, set));
      for (std::size_t i = 0; i < sweep_.x_.size(); ++i) x[i] = start->values.at(sweep_.x_[i]);
      return true;
    } catch (const UserFacing& error) {
      end(run, SharedSlots::State::failed, error.what());
      return false;
    }
  }
  void end(int run, SharedSlots::State state, const std::string& text = "") {
    slots_.set(run, state, text);
    const auto at = std::find(claimed_.begin(), claimed_.end(), run);
    *at = claimed_.back();
    claimed_.pop_back();
    if (progress_) progress_(slots_.finished());
  }

  const LaneSweep& sweep_;
  SharedSlots& slots_;
  TaskQueue& queue_;
  int left_;
  const std::function<void(int)>& progress_;
  PoleSigns poles_;
  /// The monitors of one lane, with the run and the numbers they refer to.
  struct LaneWatch {
    PeakMonitor peaks;
    SwitchMonitor switches;
    RegrowthWatch regrowth;
    std::optional<int> run;
    ProblemPtr problem;
    bool is_empty() const { return peaks.is_empty() && switches.is_empty() && regrowth.is_empty(); }
  };
  std::vector<LaneWatch> watches_;
  Stats ignored_;
  std::vector<double> base_;
  std::vector<int> claimed_;  ///< sets in progress
};

void LaneSweep::drain(SharedSlots& slots, TaskQueue& queue, const std::vector<double>& times, int most,
                      const std::function<void(int)>& progress) const {
  EnsemblePlan plan = plan_;
  plan.times = times;
  Client client(*this, slots, queue, most, progress);
  const FlushDenormals guard;
  try {
    Ensemble(code_, std::move(plan)).run(client);
  } catch (const Interrupted&) {
    client.give_back();
    throw;
  }
}

}  // namespace pendula::integrate
