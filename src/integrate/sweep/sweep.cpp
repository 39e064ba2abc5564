#include "integrate/sweep/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "integrate/sweep/sweep_lanes.hpp"

namespace pendula::integrate {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t head = store::Record::head;
constexpr double most_kept = 2e7;  ///< numbers kept by default: 160 MB
constexpr int usual_times = 101;

bool stopped_by_event(const Solution& solution) {
  return solution.ending() == Ending::event && !solution.events().empty();
}

}  // namespace

Sweep::Sweep(SweepRequest request, bool keep_ends) : request_(std::move(request)) {
  inputs_ = request_.simulation.inputs;
  if (request_.workers == 0) request_.workers = available_workers();
  choose_times(keep_ends);
  on_lanes_ = LaneSweep::make(request_, arguments_, why_);
  why_ = on_lanes_ ? text(on_lanes_->lanes(), " runs at a time on SIMD lanes, ", on_lanes_->method())
                   : text("one run after another: ", why_);
}

void Sweep::run(const Progress& progress) {
  std::vector<int> all(runs());
  std::iota(all.begin(), all.end(), 0);
  const auto slots = std::make_shared<SharedSlots>(std::move(all), numbers_of(times_));
  complete_ = run_all(*slots, times_, progress);
  results_ = results_in(slots, arguments_.size());
}

void Sweep::open(Results results, bool complete) {
  results_ = std::move(results);
  complete_ = complete;
}

/// The saved times: those requested, or about a hundred (mesh points for fixed steps), or the end alone.
void Sweep::choose_times(bool keep_ends) {
  const Plan& plan = request_.simulation.plan;
  const dae::FirstOrder form = dae::first_order(*request_.model);
  arguments_ = {time_symbol()};
  for (const auto* group : {&form.x, &form.xdot, &form.z, &form.u, &form.p})
    for (Expr leaf : *group)
      if (!inputs_.count(leaf)) arguments_.push_back(leaf);
  std::vector<Expr> values;
  for (const auto& [leaf, value] : inputs_) values.push_back(value);
  for (Expr leaf : leaves(values))  // parameters that occur only in inputs
    if (symbol_of(leaf).kind == Kind::parameter &&
        std::find(arguments_.begin(), arguments_.end(), leaf) == arguments_.end() &&
        std::find(form.p.begin(), form.p.end(), leaf) == form.p.end())
      arguments_.push_back(leaf);
  if (plan.times) {
    times_ = *plan.times;
    return;
  }
  const double kept = static_cast<double>(runs()) * usual_times * static_cast<double>(arguments_.size());
  if (keep_ends || kept > most_kept || !(plan.to > plan.from)) return;
  const double length = plan.to - plan.from;
  const long steps =
      plan.dt ? std::max(1L, std::lround(std::ceil(length / *plan.dt - 1e-9))) : usual_times - 1;
  const long count = std::min<long>(steps, usual_times - 1);
  for (long k = 0; k <= count; ++k) {
    const long step = (k * steps) / count;
    const double dt = plan.dt.value_or(length / static_cast<double>(steps));
    times_.push_back(step == steps ? plan.to : plan.from + static_cast<double>(step) * dt);
  }
}

TrajectoryPtr Sweep::simulate_one(int run, const std::optional<std::vector<double>>& times) const {
  const SweepSet set = request_.set(run);
  Simulation simulation = request_.simulation;
  dae::StartRequest start = (set.at ? set.at : simulation.start)->request;
  for (const auto& [p, value] : set.parameters) {
    start.parameters[p] = Expr(value);
    simulation.parameters[p] = Expr(value);
  }
  for (const auto& [leaf, value] : set.start) {
    const auto same = [&, wanted = leaf](const auto& fix) { return fix.first == wanted; };
    std::erase_if(start.fix, same);
    start.fix.emplace_back(leaf, value);
  }
  const bool own = set.at || !set.parameters.empty() || !set.start.empty();
  if (own) simulation.start = dae::init(request_.model, start);
  simulation.plan.times = times;
  return simulate(request_.model, simulation);
}

TrajectoryPtr Sweep::trajectory(int run) const { return simulate_one(run, request_.simulation.plan.times); }

/// Writes the values of all leaves at the end of the run, then at the times that it reached.
void Sweep::keep(const Trajectory& trajectory, const std::vector<double>& times, double* numbers) const {
  const Solution& solution = trajectory.solution();
  const std::size_t width = arguments_.size();
  Point end;
  if (stopped_by_event(solution)) {  // between two saved times
    end = solution.events().back().after;
    end.t = solution.events().back().t;
  } else {
    end = solution.final();
  }
  const Stats& stats = solution.stats();
  const double first[head] = {end.t, static_cast<double>(stats.steps), static_cast<double>(stats.rejected),
                              static_cast<double>(stats.evaluations)};
  double* out = std::copy(first, first + head, numbers);
  const Vec last = solution.values(arguments_, end);
  out = std::copy(last.begin(), last.end(), out);
  const auto& saved = solution.t();
  for (double t : times) {
    const double close = 4 * std::numeric_limits<double>::epsilon() * std::fabs(t);
    const auto it = std::lower_bound(saved.begin(), saved.end(), t - close);
    if (it != saved.end() && *it <= t + close) {
      const Vec values = solution.values(arguments_, solution.point(static_cast<int>(it - saved.begin())));
      out = std::copy(values.begin(), values.end(), out);
    } else {
      out = std::fill_n(out, width, nan);
    }
  }
}

std::size_t Sweep::numbers_of(const std::vector<double>& times) const {
  return head + arguments_.size() * (times.size() + 1);
}

bool Sweep::run_all(SharedSlots& slots, const std::vector<double>& times, const Progress& progress) const {
  return (!on_lanes_ || run_on_lanes(slots, times, progress)) && run_singly(slots, times, progress);
}

/// Runs sets on lanes; false if interrupted. Sets unsuitable for lanes stay in state `waiting`.
bool Sweep::run_on_lanes(SharedSlots& slots, const std::vector<double>& times,
                         const Progress& progress) const {
  // The first sets show how long the others will take.
  const int tasks = slots.tasks(), first = request_.limit > 0 ? 0 : std::min(tasks, 8 * on_lanes_->lanes());
  const std::clock_t begin = std::clock();
  bool complete = true;
  if (first > 0)
    complete = run_queue(slots, {1, 0, progress},
                         [&](TaskQueue& queue) { on_lanes_->drain(slots, queue, times, first, progress); });
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (complete && tasks > first) {
    const bool fast = first > 0 && seconds / first * (tasks - first) < worth_a_process;
    const bool here = request_.limit <= 0 && (fast || request_.workers == 1);
    const auto rest = [&](TaskQueue& queue) {
      on_lanes_->drain(slots, queue, times, tasks, here ? progress : nullptr);
    };
    complete = run_queue(slots, {here ? 1 : request_.workers, request_.limit, progress}, rest);
  }
  apart_ = 0;
  for (int task = 0; task < tasks; ++task) {
    if (slots.state(task) != SharedSlots::State::apart) continue;
    slots.set(task, SharedSlots::State::waiting);
    ++apart_;
  }
  return complete;
}

bool Sweep::run_singly(SharedSlots& slots, const std::vector<double>& times, const Progress& progress) const {
  std::vector<double> wanted = times;
  const double to = request_.simulation.plan.to;
  if (wanted.empty() || wanted.back() < to) wanted.push_back(to);  // the end is always kept
  const auto one = [&](int task, double* numbers) {
    const TrajectoryPtr result = simulate_one(slots.run(task), wanted);
    const Solution& solution = result->solution();
    if (solution.ending() == Ending::interrupted) throw Interrupted();
    const bool has_end = stopped_by_event(solution) || !solution.t().empty();
    if (!has_end || !solution.outcome().is_complete()) throw Failure(solution.status());
    keep(*result, times, numbers);
  };
  return run_tasks_here_first(slots, {request_.workers, request_.limit, progress}, one);
}

std::string Sweep::why() const {
  return why_ + (apart_ > 0 ? text("; ", apart_, " one after another: they turned stiff or failed") : "");
}

int Sweep::lanes() const { return on_lanes_ ? on_lanes_->lanes() : 1; }

std::string Sweep::failure(int run) const { return results_->failure(run); }

void Sweep::visit(const RunResults& results, std::span<const Expr> expressions, std::size_t place,
                  const Visitor& visitor) const {
  std::vector<Expr> own;
  for (Expr e : expressions) own.push_back(substitute(dae::resolve(*request_.model, e), inputs_));
  const codegen::Kernel kernel(own, arguments_);
  std::vector<double> values(own.size());
  results.visit(place, [&](int run, const double*, const double* leaves) {
    if (std::isnan(leaves[0])) return;  // the run ended before
    kernel(leaves, values.data());
    visitor(run, values.data());
  });
}

Mat Sweep::table(const RunResults& results, std::span<const Expr> expressions, std::size_t place) const {
  const auto width = static_cast<Eigen::Index>(expressions.size());
  Mat all = Mat::Constant(runs(), width, nan);
  visit(results, expressions, place, [&](int run, const double* values) {
    all.row(run) = Eigen::Map<const Eigen::RowVectorXd>(values, width);
  });
  return all;
}

Mat Sweep::final(std::span<const Expr> expressions) const { return table(*results_, expressions, 0); }

Mat Sweep::at_saved(std::span<const Expr> expressions, int number) const {
  return table(*results_, expressions, static_cast<std::size_t>(number) + 1);
}

/// Throws Error if t lies outside the interval.
std::optional<std::size_t> Sweep::saved_place(double t) const {
  const Plan& plan = request_.simulation.plan;
  const double close =
      4 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(plan.from), std::fabs(plan.to));
  if (!(t >= plan.from - close && t <= plan.to + close))
    throw Error(text("t = ", rounded(t), " lies outside the sweep, which covers ", rounded(plan.from),
                     " ≤ t ≤ ", rounded(plan.to)));
  for (std::size_t k = 0; k < times_.size(); ++k)
    if (std::fabs(times_[k] - t) <= close) return k + 1;
  return {};
}

Mat Sweep::at(std::span<const Expr> expressions, double t) const {
  if (const auto place = saved_place(t)) return table(*results_, expressions, *place);
  std::vector<int> all(runs());
  std::iota(all.begin(), all.end(), 0);
  const auto slots = std::make_shared<SharedSlots>(std::move(all), numbers_of({t}));
  if (!run_all(*slots, {t}, {})) throw Interrupted();
  return table(*results_in(slots, arguments_.size()), expressions, 1);
}

void Sweep::each(std::span<const Expr> expressions, std::optional<double> t, const Visitor& visitor) const {
  const auto place = t ? saved_place(*t) : std::optional<std::size_t>(0);
  if (place) return visit(*results_, expressions, *place, visitor);
  const Mat all = at(expressions, *t);
  for (int run = 0; run < runs(); ++run) {
    const Vec row = all.row(run);
    if (row.array().isNaN().all()) continue;
    visitor(run, row.data());
  }
}

Sweep::Counts Sweep::counts() const {
  Counts counts;
  counts.failures = static_cast<double>(results_->failures().size());
  results_->visit(0, [&](int, const double* numbers, const double*) {
    ++counts.done;
    counts.steps += numbers[1];
    counts.rejected += numbers[2];
    counts.evaluations += numbers[3];
  });
  return counts;
}

}  // namespace pendula::integrate
