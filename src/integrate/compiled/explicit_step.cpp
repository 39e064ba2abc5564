#include "integrate/compiled/explicit_step.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "codegen/program/checked.hpp"
#include "integrate/compiled/pair_emitter.hpp"
#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

/// The distinct times of stages 2 … s and of the end of the step, in units of the step size.
std::vector<double> times_of(const Tableau& rk) {
  std::vector<double> list(rk.c().begin() + 1, rk.c().end());
  list.push_back(1);
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

/// f, followed by the expressions that the projections evaluate at the end of the step.
std::vector<Expr> expressions(const Problem& problem) {
  std::vector<Expr> list = problem.model().f;
  for (const dae::Projection& stage : problem.projections()) {
    list.insert(list.end(), stage.residuals.begin(), stage.residuals.end());
    for (const pendula::Entry& e : stage.jacobian) list.push_back(e.value);
  }
  return list;
}

/// Layout of the inputs of the program: h | x | K₁ | p | atol | rtol | (t, u) at the times of the stages |
/// subexpressions that depend on time alone, at the same times.
struct Layout {
  std::size_t n, p, u, times, parts;

  Layout(const Problem& problem, std::size_t time_points, std::size_t time_parts)
      : n(static_cast<std::size_t>(problem.n())),
        p(parameter_count(problem)),
        u(input_count(problem)),
        times(time_points),
        parts(time_parts) {}
  std::size_t x() const { return 1; }
  std::size_t slope() const { return x() + n; }
  std::size_t parameters() const { return slope() + n; }
  std::size_t atol() const { return parameters() + p; }
  std::size_t rtol() const { return atol() + n; }
  std::size_t time(std::size_t which) const { return rtol() + n + which * (1 + u); }
  std::size_t part(std::size_t which, std::size_t k) const {
    return time(times) + TimeCode::place(which, k, parts);
  }
  std::size_t size() const { return time(times) + TimeCode::size(times, parts); }
};

/// Emits the instructions of one step.
class ExplicitEmitter {
 public:
  ExplicitEmitter(const Problem& problem, const Tableau& rk, std::optional<int> stiff_stage,
                  const TimePart& timed)
      : problem_(problem),
        rk_(rk),
        stiff_stage_(stiff_stage),
        times_(times_of(rk)),
        at_(problem, times_.size(), timed.parts.size()),
        w_(at_.size()),
        x_(inputs_from(w_, at_.x(), at_.n)),
        all_(problem.arguments()),
        at_end_(timed.outputs.begin() + static_cast<std::ptrdiff_t>(at_.n), timed.outputs.end()) {
    all_.insert(all_.end(), timed.symbols.begin(), timed.symbols.end());
    f_ = codegen::lower_checked(std::span(timed.outputs).first(at_.n), all_);
  }

  /// Outputs: as in CompiledExplicitStep::End.
  Program step() {
    early_parts();
    const auto slope = [this](int stage, const Slots& x) {
      Slots values = w_.inlined(f_, arguments_at(stage, x));
      if (values.size() > at_.n) sound_.push_back(values.back());
      values.resize(at_.n);
      return values;
    };
    PairEmitter pair(w_, rk_, Formula(w_, w_.input(0)), x_, inputs_from(w_, at_.slope(), at_.n), slope);
    const Slots x1 = pair.end(), xdot = pair.slope_at_end();
    const Slots weight = pair.weights(inputs_from(w_, at_.rtol(), at_.n), inputs_from(w_, at_.atol(), at_.n));
    const Slots error = pair.error(rk_.compared(), weight);
    Slots results = x1;
    results.insert(results.end(), xdot.begin(), xdot.end());
    results.insert(results.end(), error.begin(), error.end());
    add_sizes(pair.squares(error), results);
    if (rk_.bhat2()) {
      add_sizes(pair.squares(pair.error(rk_.bhat2(), weight)), results);
    } else {
      results.insert(results.end(), 2, w_.constant(0));
    }
    if (stiff_stage_) {
      const PairEmitter::Differences d = pair.differences(*stiff_stage_, xdot, weight);
      results.insert(results.end(), {d.slopes, d.points});
    } else {
      results.insert(results.end(), 2, w_.constant(0));
    }
    Slot all = w_.constant(1);
    for (Slot sound : sound_) all = w_.put(Op::mul, all, sound);
    results.push_back(all);
    for (const dae::Projection& stage : problem_.projections()) add_margins(stage, x1, results);
    return w_.finish(std::move(results));
  }

 private:
  /// Sum and maximum of the squares. The maximum is 0 where it cannot exceed nine times the mean (ErrorSum).
  void add_sizes(const Slots& squares, Slots& results) {
    results.push_back(w_.sum(squares));
    results.push_back(squares.size() < 9 ? w_.constant(0) : w_.largest(squares));
  }
  /// The arguments of f at stage i, or at the end, i = s. Equal for stages at the same time.
  Slots arguments_at(int i, std::span<const Slot> x) const {
    const double c = i < rk_.stages() ? rk_.c()[i] : 1.0;
    const auto which = static_cast<std::size_t>(std::find(times_.begin(), times_.end(), c) - times_.begin());
    Slots parts;
    for (std::size_t k = 0; k < at_.parts; ++k) parts.push_back(w_.input(at_.part(which, k)));
    const std::size_t time = at_.time(which);
    return arguments(w_.input(time), {x, x, inputs_from(w_, time + 1, at_.u),  // f contains no x′
                                      inputs_from(w_, at_.parameters(), at_.p), parts});
  }
  /// Evaluates the subexpressions that depend on time alone, unless they are inputs. All stages come first,
  /// because a call of a function like sin clobbers the registers and none is in use yet.
  void early_parts() {
    std::vector<bool> early(all_.size(), true);
    std::fill_n(early.begin() + 1, 2 * at_.n, false);
    for (int i = 1; i <= rk_.stages(); ++i) w_.inline_part(f_, arguments_at(i, x_), early);
  }

  /// The margin of every condition: the admissible violation less the actual one.
  void add_margins(const dae::Projection& stage, const Slots& x1, Slots& results) {
    const std::vector<Expr>& x = problem_.model().x;
    const std::size_t count = stage.residuals.size() + stage.jacobian.size();
    const auto value = [this](Slot slot) { return Formula(w_, slot); };
    const Slots values = w_.inlined(codegen::lower(std::span(at_end_).subspan(margins_done_, count), all_),
                                    arguments_at(rk_.stages(), x1));
    margins_done_ += count;
    std::vector<Slots> effects(stage.residuals.size());
    for (std::size_t e = 0; e < stage.jacobian.size(); ++e) {
      const pendula::Entry& entry = stage.jacobian[e];
      const Expr unknown = stage.unknowns[entry.column];
      const auto j = static_cast<std::size_t>(std::find(x.begin(), x.end(), unknown) - x.begin());
      const Formula atol = value(w_.input(at_.atol() + j)), rtol = value(w_.input(at_.rtol() + j));
      const Formula change = atol + rtol * magnitude(value(x1[j]));
      const Formula slope = magnitude(value(values[stage.residuals.size() + e]));
      effects[entry.row].push_back((slope * change).slot(w_));
    }
    for (std::size_t i = 0; i < effects.size(); ++i) {
      const Formula allowed = Problem::projection_share * value(w_.sum(effects[i]));
      results.push_back((allowed - magnitude(value(values[i]))).slot(w_));
    }
  }

  const Problem& problem_;
  const Tableau& rk_;
  std::optional<int> stiff_stage_;
  std::vector<double> times_;
  Layout at_;
  Writer w_;
  Slots x_;
  std::vector<Expr> all_, at_end_;  ///< arguments; expressions evaluated by the projections
  std::size_t margins_done_ = 0;    ///< number of elements of at_end_ that are used
  Slots sound_;                     ///< per stage: 1 if its linear system needed no pivoting, else 0
  Program f_;
};

Key key_of(const Problem& problem, const Tableau& rk, std::optional<int> stiff_stage) {
  Key key{0, static_cast<std::uint32_t>(rk.stages()), static_cast<std::uint32_t>(stiff_stage.value_or(0))};
  add(key, problem.model().f);
  add(key, problem.arguments());
  for (int i = 0; i < rk.stages(); ++i) {
    add(key, rk.c()[i]);
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    for (const auto& row :
         {std::optional<Vec>(rk.b()), std::optional<Vec>(rk.compared()), std::optional<Vec>(rk.bhat2())})
      add(key, row ? (*row)[i] : 0);
  }
  for (const dae::Projection& stage : problem.projections()) {
    add(key, stage.residuals);
    add(key, stage.unknowns);
    for (const pendula::Entry& e : stage.jacobian) {
      key.push_back(static_cast<std::uint32_t>(e.row));
      key.push_back(static_cast<std::uint32_t>(e.column));
      key.push_back(e.value.id());
    }
  }
  return key;
}

}  // namespace

static void compile(StepEntry& entry, const Problem& problem, const Tableau& rk,
                    std::optional<int> stiff_stage) {
  const std::vector<Expr> outputs = expressions(problem);
  TimePart timed(Machine::available(TimeCode::lanes) ? TimePart(outputs, problem) : TimePart(outputs));
  const Program program = ExplicitEmitter(problem, rk, stiff_stage, timed).step();
  if (program.instructions.size() > longest_step_program) return;
  std::vector<std::shared_ptr<const Machine>> compiled;
  compiled.push_back(Machine::compile(program, 1, codegen::Rounding::fused));
  if (!timed.parts.empty()) compiled.push_back(TimeCode::compile(timed, problem));
  entry.keep_if_complete(std::move(compiled));
  entry.handed = timed.parts.size();
}

std::shared_ptr<CompiledExplicitStep> CompiledExplicitStep::make(const Problem& problem, const Tableau& rk,
                                                                 std::optional<int> stiff_stage,
                                                                 const Tolerances& tolerances) {
  if (!Machine::available() || !problem.is_ode() || problem.m() > 0) return nullptr;
  if (problem.operations() * static_cast<std::size_t>(rk.stages() - 1) > 4 * longest_step_program)
    return nullptr;
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key_of(problem, rk, stiff_stage));
  if (entry->wanted++ == 0) compile(*entry, problem, rk, stiff_stage);
  if (entry->machines.empty()) return nullptr;
  const auto n = static_cast<std::size_t>(problem.n());
  auto code = std::make_shared<CompiledExplicitStep>();
  code->machine_ = entry->machines[0];
  code->c_ = times_of(rk);
  code->parts_ = entry->handed;
  if (code->parts_ > 0) code->time_.emplace(entry->machines[1], problem, code->c_);
  const Layout at(problem, code->c_.size(), code->parts_);
  code->in_.resize(at.size());
  code->out_.resize(3 * n + 7);
  for (const dae::Projection& stage : problem.projections())
    code->out_.resize(code->out_.size() + stage.residuals.size());
  code->work_.resize(code->machine_->workspace_size());
  code->stages_ = at.time(0);
  std::copy_n(tolerances.atol.data(), n, code->in_.data() + at.atol());
  std::copy_n(tolerances.rtol.data(), n, code->in_.data() + at.rtol());
  return code;
}

CompiledExplicitStep::End CompiledExplicitStep::run(Problem& problem, const Point& from, double dt) {
  if (time_) time_->start(from.t, dt);
  double* to = in_.data();
  *to++ = dt;
  to = std::copy_n(from.x.data(), problem.n(), to);
  to = std::copy_n(from.xdot.data(), problem.n(), to);
  write_parameters(problem, to);
  double* const stages = in_.data() + stages_;
  write_stages(problem, c_, from.t, dt, stages);
  if (time_) time_->run(problem, stages, parts_, stages + c_.size() * (1 + input_count(problem)));
  machine_->run(in_.data(), out_.data(), work_.data());
  const double *x = out_.data(), *xdot = x + problem.n(), *scaled = xdot + problem.n();
  const double* norms = scaled + problem.n();
  // The compiled elimination does not pivot. NaN tells the caller to evaluate stage by stage instead.
  if (norms[6] != 1) out_[0] = std::numeric_limits<double>::quiet_NaN();
  const double* const end = out_.data() + out_.size();
  const bool near = std::all_of(norms + 7, end, [](double margin) { return margin >= 0; });
  return {x, xdot, scaled, norms[0], norms[1], norms[2], norms[3], norms[4], norms[5], near};
}

}  // namespace pendula::integrate
