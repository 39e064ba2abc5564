#include "integrate/compiled/explicit_step.hpp"

#include <algorithm>
#include <optional>

#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

using Slots = std::vector<Slot>;

/// The times of stages 2 … s and of the end, in units of the step, each once.
std::vector<double> times_of(const Tableau& rk) {
  std::vector<double> list(rk.c().begin() + 1, rk.c().end());
  list.push_back(1);
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

/// f, and what the projections evaluate at the end of the step.
std::vector<Expr> expressions(const Problem& problem) {
  std::vector<Expr> list = problem.model().f;
  for (const dae::Projection& stage : problem.projections()) {
    list.insert(list.end(), stage.residuals.begin(), stage.residuals.end());
    for (const pendula::Entry& e : stage.jacobian) list.push_back(e.value);
  }
  return list;
}

/// Writes the program. In: h | x | K₁ | p | atol | rtol | (t, u) at the times of the stages | what depends on
/// time alone, there.
class Author {
 public:
  Author(const Problem& problem, const Tableau& rk, int stiff_stage, const TimePart& timed)
      : problem_(problem),
        rk_(rk),
        stiff_stage_(stiff_stage),
        n_(static_cast<std::size_t>(problem.n())),
        np_(parameter_count(problem)),
        nu_(input_count(problem)),
        parts_(timed.parts.size()),
        times_(times_of(rk)),
        w_(inputs(problem, times_.size(), parts_)),
        h_(w_.input(0)),
        x_(inputs_from(w_, 1, n_)),
        p_(inputs_from(w_, 1 + 2 * n_, np_)),
        K_{inputs_from(w_, 1 + n_, n_)},
        all_(problem.arguments()),
        rest_(timed.outputs.begin() + static_cast<std::ptrdiff_t>(n_), timed.outputs.end()) {
    all_.insert(all_.end(), timed.symbols.begin(), timed.symbols.end());
    f_ = codegen::lower(std::span(timed.outputs).first(n_), all_);
  }

  static std::size_t first_stage(const Problem& problem) {
    return 1 + 4 * static_cast<std::size_t>(problem.n()) + parameter_count(problem);
  }
  static std::size_t first_part(const Problem& problem, std::size_t times) {
    return first_stage(problem) + times * (1 + input_count(problem));
  }
  static std::size_t inputs(const Problem& problem, std::size_t times, std::size_t parts) {
    return first_part(problem, times) + TimeCode::size(times, parts);
  }

  /// Out: as in ExplicitCode::End.
  Program step() {
    const int s = rk_.stages();
    early_parts();
    for (int i = 1; i < s; ++i) K_.push_back(slope(i, point(row_of(rk_.A(), i, i))));
    const std::vector<double> b(rk_.b().begin(), rk_.b().end());
    const Slots x1 = point(b), xdot = slope(s, x1), weight = weights(x1);
    const Slots error = scaled(difference(rk_.bhat()), weight),
                second = scaled(difference(rk_.bhat2()), weight);
    Slots results = x1;
    results.insert(results.end(), xdot.begin(), xdot.end());
    results.insert(results.end(), error.begin(), error.end());
    for (const Slots& list : {squares(error), squares(second)})
      results.push_back(w_.sum(list)), results.push_back(w_.largest(list));
    watch(xdot, weight, results);
    for (const dae::Projection& stage : problem_.projections()) add_margins(stage, x1, results);
    return w_.finish(std::move(results));
  }

 private:
  /// h Σ factorsⱼ Kⱼ, component k.
  Slot sum(const std::vector<double>& factors, std::size_t k) {
    Slots terms;
    for (std::size_t j = 0; j < factors.size(); ++j) terms.push_back(K_[j][k]);
    return w_.put(Op::mul, h_, w_.combination(factors, terms));
  }
  Slots point(const std::vector<double>& factors) {
    for (std::size_t i = 0; i < rows_.size(); ++i)  // the last stage of a method "first same as last"
      if (std::equal(rows_[i].begin(), rows_[i].end(), factors.begin()) &&
          std::all_of(factors.begin() + static_cast<std::ptrdiff_t>(rows_[i].size()), factors.end(),
                      [](double b) { return b == 0; }))
        return X_[i];
    rows_.push_back(factors), X_.emplace_back();
    for (std::size_t k = 0; k < n_; ++k) X_.back().push_back(w_.put(Op::add, x_[k], sum(factors, k)));
    return X_.back();
  }
  /// The arguments of f at stage i, or at the end, i = s. Equal for stages at the same time.
  Slots arguments_at(int i, std::span<const Slot> x) {
    const double c = i < rk_.stages() ? rk_.c()[i] : 1.0;
    const auto time = static_cast<std::size_t>(std::find(times_.begin(), times_.end(), c) - times_.begin());
    const std::size_t at = first_stage(problem_) + time * (1 + nu_),
                      part = first_part(problem_, times_.size());
    Slots parts;
    for (std::size_t k = 0; k < parts_; ++k)
      parts.push_back(w_.input(part + TimeCode::place(time, k, parts_)));
    return arguments(w_.input(at), {x, x, inputs_from(w_, at + 1, nu_), p_, parts});  // f contains no x′
  }
  Slots slope(int i, const Slots& x) { return w_.inlined(f_, arguments_at(i, x)); }
  /// What depends on time alone, where it is not given: for all stages at once, so that functions like sin
  /// are called while no register holds anything.
  void early_parts() {
    std::vector<bool> early(all_.size(), true);
    std::fill_n(early.begin() + 1, 2 * n_, false);
    for (int i = 1; i <= rk_.stages(); ++i) w_.inline_part(f_, arguments_at(i, x_), early);
  }
  /// b - b̂; zeros where there is no b̂.
  std::vector<double> difference(const std::optional<Vec>& embedded) const {
    std::vector<double> e(static_cast<std::size_t>(rk_.stages()), 0);
    for (std::size_t j = 0; embedded && j < e.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      e[j] = rk_.b()[k] - (*embedded)[k];
    }
    return e;
  }
  /// 1/(atol + rtol max(|x|, |x₁|))
  Slots weights(const Slots& x1) {
    const std::size_t atol = 1 + 2 * n_ + np_, rtol = atol + n_;
    Slots list;
    for (std::size_t k = 0; k < n_; ++k) {
      const Slot size = w_.put(Op::max, w_.put(Op::abs, x_[k]), w_.put(Op::abs, x1[k]));
      const Slot scale = w_.put(Op::add, w_.input(atol + k), w_.put(Op::mul, w_.input(rtol + k), size));
      list.push_back(w_.put(Op::div, w_.constant(1), scale));
    }
    return list;
  }
  Slots scaled(const std::vector<double>& factors, const Slots& weight) {
    const bool none = std::all_of(factors.begin(), factors.end(), [](double e) { return e == 0; });
    Slots list;
    for (std::size_t k = 0; k < n_; ++k)
      list.push_back(none ? w_.constant(0) : w_.put(Op::mul, sum(factors, k), weight[k]));
    return list;
  }
  Slots squares(const Slots& list) {
    Slots result;
    for (Slot v : list) result.push_back(w_.put(Op::mul, v, v));
    return result;
  }
  void watch(const Slots& xdot, const Slots& weight, Slots& results) {
    Slots slopes, changes;
    for (std::size_t k = 0; k < n_ && stiff_stage_ > 0; ++k) {
      const auto g = static_cast<std::size_t>(stiff_stage_);
      slopes.push_back(w_.put(Op::mul, w_.put(Op::sub, xdot[k], K_[g][k]), weight[k]));
      const Slot change = w_.put(Op::sub, point({rk_.b().begin(), rk_.b().end()})[k],
                                 point(row_of(rk_.A(), stiff_stage_, stiff_stage_))[k]);
      changes.push_back(w_.put(Op::mul, change, weight[k]));
    }
    results.push_back(w_.sum(squares(slopes))), results.push_back(w_.sum(squares(changes)));
  }

  /// For every condition: how far it is from being violated too much; negative if it is.
  void add_margins(const dae::Projection& stage, const Slots& x1, Slots& results) {
    const std::vector<Expr>& x = problem_.model().x;
    const std::size_t count = stage.residuals.size() + stage.jacobian.size();
    const Slots values = w_.inlined(codegen::lower(std::span(rest_).subspan(in_rest_, count), all_),
                                    arguments_at(rk_.stages(), x1));
    in_rest_ += count;
    const std::size_t atol = 1 + 2 * n_ + np_, rtol = atol + n_;
    std::vector<Slots> effects(stage.residuals.size());
    for (std::size_t e = 0; e < stage.jacobian.size(); ++e) {
      const pendula::Entry& entry = stage.jacobian[e];
      const Expr unknown = stage.unknowns[entry.column];
      const auto j = static_cast<std::size_t>(std::find(x.begin(), x.end(), unknown) - x.begin());
      const Slot size = w_.put(Op::mul, w_.input(rtol + j), w_.put(Op::abs, x1[j]));
      const Slot change = w_.put(Op::add, w_.input(atol + j), size);
      effects[entry.row].push_back(
          w_.put(Op::mul, w_.put(Op::abs, values[stage.residuals.size() + e]), change));
    }
    for (std::size_t i = 0; i < effects.size(); ++i) {
      const Slot allowed = w_.put(Op::mul, w_.constant(ExplicitCode::share), w_.sum(effects[i]));
      results.push_back(w_.put(Op::sub, allowed, w_.put(Op::abs, values[i])));
    }
  }

  const Problem& problem_;
  const Tableau& rk_;
  int stiff_stage_;
  std::size_t n_, np_, nu_, parts_;
  std::vector<double> times_;
  Writer w_;
  Slot h_;
  Slots x_, p_;
  std::vector<Slots> K_, X_;  ///< slopes of the stages; points, as they were asked for
  std::vector<std::vector<double>> rows_;
  std::vector<Expr> all_, rest_;  ///< arguments; what the projections evaluate
  std::size_t in_rest_ = 0;
  Program f_;
};

Key key_of(const Problem& problem, const Tableau& rk, int stiff_stage) {
  Key key{0, static_cast<std::uint32_t>(rk.stages()), static_cast<std::uint32_t>(stiff_stage)};
  add(key, problem.model().f), add(key, problem.arguments());
  for (int i = 0; i < rk.stages(); ++i) {
    add(key, rk.c()[i]);
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    for (const auto& row :
         {std::optional<Vec>(rk.b()), std::optional<Vec>(rk.bhat()), std::optional<Vec>(rk.bhat2())})
      add(key, row ? (*row)[i] : 0);
  }
  for (const dae::Projection& stage : problem.projections()) {
    add(key, stage.residuals), add(key, stage.unknowns);
    for (const pendula::Entry& e : stage.jacobian) {
      key.push_back(static_cast<std::uint32_t>(e.row)), key.push_back(static_cast<std::uint32_t>(e.column));
      key.push_back(e.value.id());
    }
  }
  return key;
}

}  // namespace

static void compile(StepEntry& entry, const Problem& problem, const Tableau& rk, int stiff_stage) {
  const std::vector<Expr> outputs = expressions(problem);
  TimePart timed(Machine::available(TimeCode::lanes) ? TimePart(outputs, problem) : TimePart(outputs));
  const Program program = Author(problem, rk, stiff_stage, timed).step();
  if (program.instructions.size() > longest_step_program) return;
  std::vector<std::shared_ptr<const Machine>> compiled;
  compiled.push_back(Machine::compile(program, 1, codegen::Rounding::fused));
  if (!timed.parts.empty()) compiled.push_back(TimeCode::compile(timed, problem));
  entry.keep_if_complete(std::move(compiled));
  entry.handed = timed.parts.size();
}

std::shared_ptr<ExplicitCode> ExplicitCode::make(const Problem& problem, const Tableau& rk, int stiff_stage,
                                                 const Tolerances& tolerances) {
  if (!Machine::available() || !problem.is_ode() || problem.m() > 0) return nullptr;
  if (problem.operations() * static_cast<std::size_t>(rk.stages() - 1) > 4 * longest_step_program)
    return nullptr;
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key_of(problem, rk, stiff_stage));
  if (entry->wanted++ == 0) compile(*entry, problem, rk, stiff_stage);
  if (entry->machines.empty()) return nullptr;
  const auto n = static_cast<std::size_t>(problem.n());
  auto code = std::make_shared<ExplicitCode>();
  code->machine_ = entry->machines[0];
  code->c_ = times_of(rk);
  code->parts_ = entry->handed;
  if (code->parts_ > 0) code->time_.emplace(entry->machines[1], problem, code->c_);
  code->in_.resize(Author::inputs(problem, code->c_.size(), code->parts_));
  code->out_.resize(3 * n + 6);
  for (const dae::Projection& stage : problem.projections())
    code->out_.resize(code->out_.size() + stage.residuals.size());
  code->work_.resize(code->machine_->workspace_size());
  code->stages_ = Author::first_stage(problem);
  double* const weights = code->in_.data() + 1 + 2 * n + parameter_count(problem);
  std::copy_n(tolerances.rtol.data(), n, std::copy_n(tolerances.atol.data(), n, weights));
  return code;
}

ExplicitCode::End ExplicitCode::run(Problem& problem, const Point& from, double dt) {
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
  const double* const end = out_.data() + out_.size();
  const bool near = std::all_of(norms + 6, end, [](double margin) { return margin >= 0; });
  return {x, xdot, scaled, norms[0], norms[1], norms[2], norms[3], norms[4], norms[5], near};
}

}  // namespace pendula::integrate
