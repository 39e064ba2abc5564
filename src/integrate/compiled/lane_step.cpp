#include "integrate/compiled/lane_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "base/epsilon.hpp"
#include "codegen/program/program_cache.hpp"
#include "integrate/compiled/pair_emitter.hpp"
#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {

using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

/// 0, or NaN if one of the numbers is not finite.
Formula defect(Writer& w, const Slots& list) {
  Formula sum(w, w.constant(0));
  for (Slot v : list) sum = sum + Formula(w, v) * 0.0;
  return sum;
}

/// ErrorSum::norm of numbers, given their squares.
Formula norm(Writer& w, const Slots& squares, Slot sum) {
  const auto count = static_cast<double>(squares.size());
  const Formula mean = Formula(w, sum) / count;
  if (squares.size() < 9) return square_root(mean);  // the largest square is at most eight times the mean
  const Formula floor = Formula(w, w.largest(squares)) * (1.0 / 9);
  return square_root(choose(mean < floor, floor, mean));
}

/// Emits the three programs.
class LaneEmitter {
 public:
  LaneEmitter(const Problem& problem, const Tableau& rk, bool watch)
      : problem_(problem),
        rk_(rk),
        controller_(StepRules(rk), problem.n()),
        watch_(watch),
        n_(static_cast<std::size_t>(problem.n())),
        p_(problem.model().p.size()),
        f_(codegen::lower(problem.model().f, problem.arguments())) {}

  Program step();
  Program start();
  Program between();

 private:
  using Controller = StepController<Formula>;
  using State = StepState<Formula>;

  /// f(t, x, p).
  Slots rhs(Writer& w, Formula t, const Slots& x, const Slots& p) const {
    return w.inlined(f_, arguments(t.slot(w), {x, x, p}));  // f contains no x′
  }

  /// The inputs of a step, by name.
  struct Lane {
    Slots number, given, x, xdot, p, rtol, atol;
  };
  Lane lane_inputs(const Writer& w) const;
  std::size_t lane_size() const {
    return std::size_t{lane::numbers} + std::size_t{lane::given} + 4 * n_ + p_;
  }
  PairEmitter pair(Writer& w, Formula t, Formula h, Formula arrival, const Lane& s,
                   std::vector<char> wanted) const;
  std::vector<char> wanted() const;
  Formula error_norm(Writer& w, PairEmitter& pair, const Slots& weight) const;
  StepSigns<Formula> signs(Writer& w, PairEmitter& pair, const Lane& s) const;
  static State choose_state(Formula condition, const State& yes, const State& no);

  const Problem& problem_;
  const Tableau& rk_;
  Controller controller_;
  bool watch_;
  std::size_t n_, p_;
  Program f_;
};

LaneEmitter::Lane LaneEmitter::lane_inputs(const Writer& w) const {
  std::size_t at = 0;
  const auto next = [&](std::size_t count) {
    at += count;
    return inputs_from(w, at - count, count);
  };
  Lane s;
  s.number = next(lane::numbers);
  s.x = next(n_);
  s.xdot = next(n_);
  s.given = next(lane::given);
  s.p = next(p_);
  s.rtol = next(n_);
  s.atol = next(n_);
  return s;
}

/// A step of length h from (t, x). `wanted` marks the stages whose slopes are used.
PairEmitter LaneEmitter::pair(Writer& w, Formula t, Formula h, Formula arrival, const Lane& s,
                              std::vector<char> wanted) const {
  std::vector<Formula> times;
  for (int i = 0; i < rk_.stages(); ++i) times.push_back(t + (rk_.c()[i] == 1 ? h : rk_.c()[i] * h));
  times.push_back(arrival);
  // Expressions of time alone come first: function calls clobber the registers.
  std::vector<bool> early(problem_.arguments().size(), true);
  std::fill_n(early.begin() + 1, 2 * n_, false);
  for (int i = rk_.stages() - 1; i > 0; --i)
    for (int j = 0; wanted[i] && j < i; ++j)
      if (rk_.A()(i, j) != 0) wanted[j] = 1;
  for (int i = 1; i < rk_.stages(); ++i)
    if (wanted[i]) w.inline_part(f_, arguments(times[i].slot(w), {s.x, s.x, s.p}), early);
  const auto slope = [this, &w, times, p = s.p](int stage, const Slots& x) {
    return rhs(w, times[stage], x, p);
  };
  return PairEmitter(w, rk_, h, s.x, s.xdot, slope);
}

/// In: h, t, x, x′, p.
Program LaneEmitter::between() {
  Writer w(2 + 2 * n_ + p_);
  const Formula h(w, w.input(0)), t(w, w.input(1));
  Lane s;
  s.x = inputs_from(w, 2, n_);
  s.xdot = inputs_from(w, 2 + n_, n_);
  s.p = inputs_from(w, 2 + 2 * n_, p_);
  std::vector<char> wanted;
  for (double weight : rk_.b()) wanted.push_back(weight != 0);
  PairEmitter step = pair(w, t, h, t + h, s, wanted);
  Slots results = step.end();
  const Slots slope = rhs(w, t + h, results, s.p);
  results.insert(results.end(), slope.begin(), slope.end());
  return w.finish(std::move(results));
}

/// As ExplicitStepper::first_step.
Program LaneEmitter::start() {
  Writer w(lane_size());
  const Lane s = lane_inputs(w);
  const auto value = [&](Slot slot) { return Formula(w, slot); };
  const Formula t = value(s.number[lane::t]);
  const Slots slope = rhs(w, t, s.x, s.p);
  const auto scaled_norm = [&](const Slots& v) {
    Slots squares;
    for (std::size_t k = 0; k < n_; ++k) {
      const Formula scaled = value(v[k]) / (value(s.atol[k]) + value(s.rtol[k]) * magnitude(value(s.x[k])));
      squares.push_back((scaled * scaled).slot(w));
    }
    Slot sum = squares[0];
    for (std::size_t k = 1; k < n_; ++k) sum = w.put(Op::add, sum, squares[k]);
    return norm(w, squares, sum);
  };
  const Formula longest = lesser(value(s.given[lane::end]) - t, value(s.given[lane::dt_max]));
  const Formula size = scaled_norm(s.x), speed = scaled_norm(slope);
  const Formula cautious = cautious_step(size, speed, t, longest);
  Slots ahead;
  for (std::size_t k = 0; k < n_; ++k) ahead.push_back((value(s.x[k]) + cautious * value(slope[k])).slot(w));
  Slots change = rhs(w, t + cautious, ahead, s.p);
  const Formula defined = defect(w, change) <= 0.0;
  for (std::size_t k = 0; k < n_; ++k) change[k] = (value(change[k]) - value(slope[k])).slot(w);
  const Formula steepest = greater(speed, scaled_norm(change) / cautious);
  const Formula chosen =
      choose(defined, first_step(cautious, steepest, t, longest, controller_.rules().control_order),
             cautious * 1e-3);
  const Formula given = value(s.given[lane::dt_first]);
  const State state = controller_.start(choose(0.0 < given, given, chosen));
  Slots results{t.slot(w), w.constant(0)};
  for (auto field : State::fields) results.push_back((state.*field).slot(w));
  results.insert(results.end(), s.x.begin(), s.x.end());
  results.insert(results.end(), slope.begin(), slope.end());
  return w.finish(std::move(results));
}

Formula LaneEmitter::error_norm(Writer& w, PairEmitter& pair, const Slots& weight) const {
  const auto of = [&](const std::optional<Vec>& embedded) {
    const Slots squares = pair.squares(pair.error(embedded, weight));
    return norm(w, squares, w.sum(squares));
  };
  const Formula first = of(rk_.compared());
  return rk_.bhat2() ? combined_error(first, of(rk_.bhat2())) : first;
}

/// As ExplicitStepper::signs.
StepSigns<Formula> LaneEmitter::signs(Writer& w, PairEmitter& pair, const Lane& s) const {
  const Slots x1 = pair.end(), slope = pair.slope_at_end(), weights = pair.weights(s.rtol, s.atol);
  Slots changes, sizes;
  for (std::size_t k = 0; k < n_; ++k) {
    const Formula x(w, x1[k]), before(w, s.xdot[k]), after(w, slope[k]);
    const Formula weight = 1 / (Formula(w, s.atol[k]) + Formula(w, s.rtol[k]) * magnitude(x));
    const Formula change = (after - before) * weight, size = after * weight;
    changes.push_back((change * change).slot(w));
    sizes.push_back((size * size).slot(w));
  }
  const auto d = pair.differences(*controller_.rules().stiff_stage, slope, weights);
  return {{w, d.slopes}, {w, d.points}, {w, w.sum(changes)}, {w, w.sum(sizes)}};
}

/// The stages whose slopes a step uses.
std::vector<char> LaneEmitter::wanted() const {
  std::vector<char> wanted;
  for (int j = 0; j < rk_.stages(); ++j) {
    const double b = rk_.b()[j];
    const bool used = b != 0 || (*rk_.compared())[j] != b || (rk_.bhat2() && (*rk_.bhat2())[j] != b);
    wanted.push_back(used || j == controller_.rules().stiff_stage);
  }
  if (rk_.is_fsal()) wanted.back() = 1;
  return wanted;
}

LaneEmitter::State LaneEmitter::choose_state(Formula condition, const State& yes, const State& no) {
  State result;
  for (auto field : State::fields) result.*field = choose(condition, yes.*field, no.*field);
  return result;
}

Program LaneEmitter::step() {
  Writer w(lane_size());
  const auto value = [&](Slot slot) { return Formula(w, slot); };
  const Lane s = lane_inputs(w);
  const Formula t = value(s.number[lane::t]), end = value(s.given[lane::end]);
  State before;
  for (std::size_t k = 0; k < State::fields.size(); ++k)
    before.*State::fields[k] = value(s.number[lane::control + k]);
  const Formula left = end - t, h = fitted_step(before.dt, left, value(s.given[lane::dt_max]));
  const Formula arrival = choose(left <= h, end, t + h);
  PairEmitter step = pair(w, t, h, arrival, s, wanted());
  const Slots x1 = step.end(), slope = step.slope_at_end();
  const Formula estimate = error_norm(w, step, step.weights(s.rtol, s.atol));
  const Formula defined = both(estimate <= std::numeric_limits<double>::max(), defect(w, slope) <= 0.0);
  const bool watches = controller_.watches_stiffness();
  const StepSigns<Formula> seen = watches ? signs(w, step, s) : StepSigns<Formula>{};
  const Formula error = watches ? choose(estimate <= 1.0,
                                         choose(controller_.resolves(h, seen), estimate,
                                                Formula(w, w.constant(Controller::unresolved))),
                                         estimate)
                                : estimate;
  const Formula accepted = both(error <= 1.0, defined);
  State onward = controller_.accept(before, h, error);
  if (watches) onward = controller_.watch(onward, h, seen);
  const State again =
      choose_state(defined, controller_.reject(before, h, error), controller_.undefined(before, h));
  const State after = choose_state(accepted, onward, again);
  // Conditions under which the loop over the steps must inspect a lane.
  const Formula smallest = greater(10 * eps * magnitude(t), 1e-300);
  const Formula vanished = both(magnitude(h) <= smallest, either(h < left, before.repeated));
  Formula attention = either(both(accepted, value(s.given[lane::next_stop]) <= arrival), vanished);
  attention = either(attention, value(s.given[lane::most_steps]) <= after.accepted);
  if (watch_) attention = either(attention, Controller::is_stiff(after));
  Slots results{choose(accepted, arrival, t).slot(w),
                (value(s.number[lane::rejected]) + after.repeated).slot(w)};
  for (auto field : State::fields) results.push_back((after.*field).slot(w));
  const auto add_chosen = [&](const Slots& yes, const Slots& no) {
    for (std::size_t k = 0; k < n_; ++k)
      results.push_back(choose(accepted, value(yes[k]), value(no[k])).slot(w));
  };
  add_chosen(x1, s.x);
  add_chosen(slope, s.xdot);
  results.push_back(attention.slot(w));
  return w.finish(std::move(results));
}

codegen::Key key_of(const Problem& problem, const Tableau& rk, bool watch, int lanes) {
  codegen::Key key{static_cast<std::uint32_t>(lanes), watch, static_cast<std::uint32_t>(rk.stages()),
                   static_cast<std::uint32_t>(problem.n())};
  for (Expr e : problem.model().f) key.push_back(e.id());
  for (Expr e : problem.arguments()) key.push_back(e.id());
  for (int i = 0; i < rk.stages(); ++i) {
    add(key, rk.c()[i]);
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    add(key, rk.b()[i]);
    add(key, (*rk.compared())[i]);
    add(key, rk.bhat2() ? (*rk.bhat2())[i] : 0);
  }
  return key;
}

}  // namespace

std::shared_ptr<const CompiledLaneStep> CompiledLaneStep::make(const Problem& problem, const Tableau& rk,
                                                               bool watch, int lanes) {
  if (!codegen::Machine::available(lanes)) return nullptr;
  static std::mutex mutex;
  static codegen::ProgramCache<const CompiledLaneStep> memory;
  const std::lock_guard lock(mutex);
  const codegen::Key key = key_of(problem, rk, watch, lanes);
  if (auto known = memory.find(key)) return known;
  LaneEmitter emitter(problem, rk, watch);
  const Program step = emitter.step();
  if (step.instructions.size() > longest) return nullptr;
  auto code = std::make_shared<CompiledLaneStep>();
  code->lanes_ = lanes;
  code->n_ = problem.n();
  code->p_ = static_cast<int>(problem.model().p.size());
  code->watch_ = watch;
  constexpr auto fused = codegen::Rounding::fused;
  code->step_ = codegen::Machine::compile(step, lanes, fused);
  code->start_ = codegen::Machine::compile(emitter.start(), lanes, codegen::Rounding::exact);  // as C++
  code->between_ = codegen::Machine::compile(emitter.between(), lanes, fused);
  if (!code->step_ || !code->start_ || !code->between_) return nullptr;
  memory.add(key, code, step.instructions.size());
  return code;
}

std::size_t CompiledLaneStep::workspace_size() const {
  return std::max({step_->workspace_size(), start_->workspace_size(), between_->workspace_size()});
}

}  // namespace pendula::integrate
