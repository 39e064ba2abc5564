#include "integrate/sweep/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "integrate/sweep/sweep_lanes.hpp"

namespace pendula::integrate {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t head = LaneSweep::head;
constexpr double most_kept = 2e7;  ///< numbers kept without being asked for: 160 MB
constexpr int usual_times = 101;

/// Runs so short that starting processes would cost more than they save are done here.
constexpr double worth_a_process = 0.02;  // seconds in all

}  // namespace

Sweep::Sweep(SweepRequest request, std::function<void(int)> progress) : request_(std::move(request)) {
  inputs_ = request_.simulation.inputs;
  if (request_.workers == 0) request_.workers = available_workers();
  choose_times();
  on_lanes_ = LaneSweep::make(request_, arguments_, why_);
  why_ = on_lanes_ ? text(on_lanes_->lanes(), " runs at a time on SIMD lanes, ", on_lanes_->method())
                   : text("one run after another: ", why_);
  slots_ = run_all(times_, complete_, progress);
}

/// What the user asked for, or about a hundred times (of the mesh, where the steps are fixed), or the end
/// alone.
void Sweep::choose_times() {
  const Plan& plan = request_.simulation.plan;
  const dae::FirstOrder form = dae::first_order(*request_.model);
  arguments_ = {time_symbol()};
  for (const auto* group : {&form.x, &form.xdot, &form.z, &form.u, &form.p})
    for (Expr leaf : *group)
      if (!inputs_.count(leaf)) arguments_.push_back(leaf);
  std::vector<Expr> values;
  for (const auto& [leaf, value] : inputs_) values.push_back(value);
  for (Expr leaf : leaves(values))  // parameters that only inputs contain
    if (symbol_of(leaf).kind == Kind::parameter &&
        std::find(arguments_.begin(), arguments_.end(), leaf) == arguments_.end() &&
        std::find(form.p.begin(), form.p.end(), leaf) == form.p.end())
      arguments_.push_back(leaf);
  if (plan.times) {
    times_ = *plan.times;
    return;
  }
  const double kept = static_cast<double>(runs()) * usual_times * static_cast<double>(arguments_.size());
  if (kept > most_kept || !(plan.to > plan.from)) return;
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

/// The values of all leaves at the times that the run reached, then at its end.
void Sweep::store(int, const Trajectory& trajectory, const std::vector<double>& times,
                  double* numbers) const {
  const Solution& solution = trajectory.solution();
  const std::size_t width = arguments_.size();
  Point end = solution.final();
  if (solution.ending() == Ending::event && !solution.events().empty()) {  // between two saved times
    end = solution.events().back().after;
    end.t = solution.events().back().t;
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

std::shared_ptr<SharedSlots> Sweep::run_all(const std::vector<double>& times, bool& complete,
                                            const std::function<void(int)>& progress) const {
  const auto slots = std::make_shared<SharedSlots>(runs(), head + arguments_.size() * (times.size() + 1));
  complete = (!on_lanes_ || run_on_lanes(*slots, times, progress)) && run_singly(*slots, times, progress);
  return slots;
}

/// False: interrupted. What lanes could not do is waiting afterwards.
bool Sweep::run_on_lanes(SharedSlots& slots, const std::vector<double>& times,
                         const std::function<void(int)>& progress) const {
  // The first sets tell how long the others will take.
  const int first = std::min(runs(), 8 * on_lanes_->lanes());
  const std::clock_t begin = std::clock();
  bool complete = run_queue(
      slots, 1, [&](TaskQueue& queue) { on_lanes_->drain(slots, queue, times, first, progress); }, progress);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (complete && runs() > first) {
    const bool here = seconds / first * (runs() - first) < worth_a_process || request_.workers == 1;
    const auto rest = [&](TaskQueue& queue) {
      on_lanes_->drain(slots, queue, times, runs(), here ? progress : nullptr);
    };
    complete = run_queue(slots, here ? 1 : request_.workers, rest, progress);
  }
  apart_ = 0;
  for (int run = 0; run < runs(); ++run) {
    if (slots.state(run) != SharedSlots::State::apart) continue;
    slots.set(run, SharedSlots::State::waiting);
    ++apart_;
  }
  return complete;
}

bool Sweep::run_singly(SharedSlots& slots, const std::vector<double>& times,
                       const std::function<void(int)>& progress) const {
  std::vector<double> wanted = times;
  const double to = request_.simulation.plan.to;
  if (wanted.empty() || wanted.back() < to) wanted.push_back(to);  // the end is always kept
  double seconds = 0;
  const auto one = [&](int run, double* numbers) {
    const TrajectoryPtr result = simulate_one(run, wanted);
    const Solution& solution = result->solution();
    if (solution.ending() == Ending::interrupted) throw Interrupted();
    if (solution.t().empty() || !solution.outcome().is_complete()) throw Failure(solution.status());
    store(run, *result, times, numbers);
  };
  // The first runs are made here: they fill the caches that the workers inherit, and tell how long a run
  // takes.
  const std::clock_t begin = std::clock();
  const int left = runs() - slots.finished();
  int tried = 0;
  for (int run = 0; run < runs() && tried < 3; ++run) {
    if (slots.state(run) != SharedSlots::State::waiting) continue;
    try {
      slots.set(run, SharedSlots::State::running);
      one(run, slots.numbers(run));
      slots.set(run, SharedSlots::State::done);
    } catch (const UserFacing& error) {
      slots.set(run, SharedSlots::State::failed, error.what());
    } catch (const Interrupted&) {
      slots.set(run, SharedSlots::State::waiting);
      return false;
    }
    ++tried;
    seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (progress) progress(slots.finished());
  }
  if (tried == left) return true;
  const bool here = seconds / tried * (left - tried) < worth_a_process;
  return run_tasks(slots, here ? 1 : std::min(request_.workers, left - tried), one, progress);
}

std::string Sweep::why() const {
  return why_ + (apart_ > 0 ? text("; ", apart_, " one after another: they turned stiff or failed") : "");
}

int Sweep::lanes() const { return on_lanes_ ? on_lanes_->lanes() : 1; }

std::string Sweep::failure(int run) const {
  return slots_->state(run) == SharedSlots::State::failed ? slots_->failure(run) : "not run: interrupted";
}

double Sweep::end(int run) const { return done(run) ? slots_->numbers(run)[0] : nan; }

Mat Sweep::evaluate(const SharedSlots& slots, std::span<const Expr> expressions, std::size_t place) const {
  std::vector<Expr> own;
  for (Expr e : expressions) own.push_back(substitute(dae::resolve(*request_.model, e), inputs_));
  const codegen::Kernel kernel(own, arguments_);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(
      runs(), static_cast<Eigen::Index>(own.size()));
  for (int i = 0; i < runs(); ++i) {
    const double* values = slots.numbers(i) + head + place * arguments_.size();
    if (slots.state(i) != SharedSlots::State::done || std::isnan(values[0])) {
      result.row(i).setConstant(nan);
    } else {
      kernel(values, result.row(i).data());
    }
  }
  return result;
}

Mat Sweep::final(std::span<const Expr> expressions) const { return evaluate(*slots_, expressions, 0); }

Mat Sweep::at_saved(std::span<const Expr> expressions, int number) const {
  return evaluate(*slots_, expressions, static_cast<std::size_t>(number) + 1);
}

Mat Sweep::at(std::span<const Expr> expressions, double t) const {
  const Plan& plan = request_.simulation.plan;
  const double close =
      4 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(plan.from), std::fabs(plan.to));
  if (!(t >= plan.from - close && t <= plan.to + close))
    throw Error(text("t = ", rounded(t), " lies outside the sweep, which covers ", rounded(plan.from),
                     " ≤ t ≤ ", rounded(plan.to)));
  for (std::size_t k = 0; k < times_.size(); ++k)
    if (std::fabs(times_[k] - t) <= close) return at_saved(expressions, static_cast<int>(k));
  bool all = true;
  const auto slots = run_all({t}, all, {});
  if (!all) throw Interrupted();
  return evaluate(*slots, expressions, 1);
}

Sweep::Counts Sweep::counts() const {
  Counts counts;
  for (int i = 0; i < runs(); ++i) {
    if (!done(i)) {
      ++counts.failures;
      continue;
    }
    const double* numbers = slots_->numbers(i);
    counts.steps += numbers[1], counts.rejected += numbers[2], counts.evaluations += numbers[3];
  }
  return counts;
}

}  // namespace pendula::integrate
