#include "integrate/compiled/newton_step.hpp"

#include <algorithm>
#include <bit>

#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

CompiledNewtonStep::Layout::Layout(const Request& q)
    : n(static_cast<std::size_t>(q.problem.n())),
      N(static_cast<std::size_t>(q.problem.n() + q.problem.m())),
      s(q.formula.c.size()),
      p(parameter_count(q.problem)),
      u(input_count(q.problem)),
      entries(q.in_mass.size()),
      factors(q.pivots.factor_count()) {}

/// Writes the programs. Inputs: as in Layout.
class CompiledNewtonStep::Programs {
 public:
  explicit Programs(const Request& request) : q_(request), f_(request.formula), at_(request) {}

  /// Lanes: systems. In: λ/h | entries of the Jacobian. Out: factors | growth.
  Program factor() const {
    Writer w(at_.factor());
    std::vector<Slot> values;
    for (std::size_t k = 0; k < at_.entries; ++k) {
      const Slot entry = w.input(at_.jacobian() + k);
      values.push_back(q_.in_mass[k] ? w.put(Op::mul, w.input(0), entry) : entry);
      values.push_back(q_.in_mass[k] ? w.put(Op::mul, w.input(1), entry) : w.constant(0));
    }
    Slot growth = 0;
    std::vector<Slot> results = q_.pivots.write_factors(w, values, true, growth);
    results.push_back(growth);
    return w.finish(std::move(results));
  }

  /// Lanes: stages. Out: F.
  Program residuals() const {
    Writer w(at_.stage_size());
    const auto y = inputs_from(w, 0, at_.N), Z = inputs_from(w, at_.stage_Z(), at_.N);
    std::vector<Slot> point, xdot = inputs_from(w, at_.stage_x(), at_.n);
    for (std::size_t k = 0; k < at_.N; ++k) point.push_back(w.put(Op::add, y[k], Z[k]));
    for (Slot& slope : xdot) slope = w.put(Op::mul, w.input(at_.stage_h()), slope);
    return w.finish(equations(w, at_.stage_t(), at_.stage_p(), point, xdot));
  }

  /// Lanes: systems. Out: Δ.
  Program solve() const {
    Writer w(at_.system_size());
    return w.finish(q_.pivots.write_solution(w, inputs_from(w, at_.factor(), 2 * at_.factors),
                                             inputs_from(w, at_.right(), 2 * at_.N), true));
  }

  /// Lanes: stages. In: ratio | c. Out: the Lagrange polynomials at 1 + c ratio, without that of node 0.
  Program weigh() const {
    Writer w(2);
    const Slot theta = w.put(Op::add, w.constant(1), w.put(Op::mul, w.input(0), w.input(1)));
    std::vector<Slot> distance, results;
    for (double node : f_.nodes)
      distance.push_back(node == 0 ? theta : w.put(Op::sub, theta, w.constant(node)));
    for (std::size_t j = 1; j < f_.nodes.size(); ++j) {
      results.push_back(w.constant(f_.barycentric[j]));
      for (std::size_t k = 0; k < f_.nodes.size(); ++k)
        if (k != j) results.back() = w.put(Op::mul, results.back(), distance[k]);
    }
    return w.finish(std::move(results));
  }

  /// No lanes. Out: error | y₁ | x₁′ | sum and largest.
  Program end() const {
    Writer w(at_.end_size());
    const auto y = inputs_from(w, 1, at_.N);
    std::vector<double> e(f_.error.begin(), f_.error.end()), slopes(at_.s + 1);
    for (double& factor : e) factor = -factor;
    std::vector<Slot> velocity;
    for (std::size_t k = 0; k < at_.n; ++k) velocity.push_back(w.put(Op::mul, mixed(w, e, k), w.input(0)));
    std::vector<Slot> F = equations(w, at_.end_t(), at_.end_p(), y, velocity);
    for (std::size_t k = 0; k < at_.N; ++k) F[k] = q_.bare[k] ? w.constant(0) : w.put(Op::neg, F[k]);
    const auto factors = inputs_from(w, at_.end_factor(), at_.factors);
    std::vector<Slot> results = q_.pivots.write_solution(w, factors, F, false), squares;
    for (std::size_t k = 0; k < at_.N; ++k) {
      const Slot scaled = w.put(Op::mul, results[k], w.input(at_.end_r() + k));
      squares.push_back(w.put(Op::mul, scaled, scaled));
    }
    for (std::size_t k = 0; k < at_.N; ++k)
      results.push_back(w.put(Op::add, y[k], mixed(w, {f_.end.begin(), f_.end.end()}, k)));
    f_.lagrange_slopes(1, slopes.data());
    slopes.erase(slopes.begin());
    if (f_.stiffly_accurate) slopes = row_of(f_.W, f_.s - 1, f_.s);
    for (std::size_t k = 0; k < at_.n; ++k)
      results.push_back(w.put(Op::mul, mixed(w, slopes, k), w.input(0)));
    results.push_back(w.sum(squares));
    results.push_back(w.largest(squares));
    return w.finish(std::move(results));
  }

 private:
  /// Σ factorsᵢ Zᵢ, component k, in the program of the end.
  Slot mixed(Writer& w, const std::vector<double>& factors, std::size_t k) const {
    std::vector<Slot> terms;
    for (std::size_t i = 0; i < at_.s; ++i) terms.push_back(w.input(at_.end_Z() + i * at_.N + k));
    return w.combination(factors, terms);
  }
  /// F; time and parameters are the inputs from `t` and `p` on.
  std::vector<Slot> equations(Writer& w, std::size_t t, std::size_t p, std::span<const Slot> y,
                              std::span<const Slot> xdot) const {
    return w.inlined(codegen::lower(q_.problem.model().F, q_.problem.arguments()),
                     arguments(w.input(t), {y.first(at_.n), xdot, y.subspan(at_.n),
                                            inputs_from(w, t + 1, at_.u), inputs_from(w, p, at_.p)}));
  }

  const Request& q_;
  const IrkFormula& f_;
  Layout at_;
};

std::shared_ptr<CompiledNewtonStep> CompiledNewtonStep::make(const Request& q, long iterations, bool now) {
  // One iteration saves 0.07 µs per unknown; compiling for 80 unknowns takes 5 ms.
  constexpr int small = 60;
  const long enough = q.problem.n() + q.problem.m() <= small ? 100 : 700;
  const std::size_t pairs = q.formula.pairs.size();
  if (!Machine::available(lanes) || pairs >= lanes || q.formula.c.size() > most_stages) return nullptr;
  Key key{1, static_cast<std::uint32_t>(q.formula.s)};
  add(key, q.problem.model().F);
  add(key, q.problem.arguments());
  for (double c : q.formula.c) add(key, c);
  for (double w : q.formula.W.reshaped()) add(key, w);
  for (double d : q.formula.end) add(key, d);
  for (char bare : q.bare) key.push_back(static_cast<std::uint32_t>(bare));
  add(key, std::bit_cast<double>(reinterpret_cast<std::uint64_t>(q.pivots.pivots().get())));
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key);
  if (entry->is_refused) return nullptr;
  if (entry->machines.empty()) {
    entry->wanted += iterations;
    entry->kept = {q.pivots.pivots()};
    if (!now && entry->wanted < enough) return nullptr;
    const Programs programs(q);
    const std::vector<std::pair<Program, int>> all{{programs.residuals(), lanes},
                                                   {programs.factor(), lanes},
                                                   {programs.solve(), lanes},
                                                   {programs.weigh(), lanes},
                                                   {programs.end(), 1}};
    entry->is_refused = true;
    for (const auto& [program, width] : all)
      if (program.instructions.size() > longest_step_program) return nullptr;
    std::vector<std::shared_ptr<const Machine>> compiled;
    for (const auto& [program, width] : all)
      compiled.push_back(Machine::compile(program, width, codegen::Rounding::fused));
    entry->keep_if_complete(std::move(compiled));
    if (entry->machines.empty()) return nullptr;
    entry->is_refused = false;
  }
  std::shared_ptr<CompiledNewtonStep> code(new CompiledNewtonStep(Layout(q), q));
  code->machines_.residuals = entry->machines[0];
  code->machines_.factor = entry->machines[1];
  code->machines_.solve = entry->machines[2];
  code->machines_.weigh = entry->machines[3];
  code->machines_.end = entry->machines[4];
  std::size_t work = 0;
  for (const auto& machine : entry->machines) work = std::max(work, machine->workspace_size());
  code->work_ = codegen::LaneArray(work);
  return code;
}

CompiledNewtonStep::CompiledNewtonStep(const Layout& at, const Request& q)
    : at_(at),
      columns_{codegen::LaneArray(8 * at.s), codegen::LaneArray(8 * at.s), codegen::LaneArray(8 * at.s),
               codegen::LaneArray(8 * (at.s + 1))},
      in_mass_(q.in_mass),
      residual_(8 * at.N),
      system_(lanes * at.system_size()),
      solution_(lanes * 2 * at.N),
      weigh_in_(8 * 2),
      weigh_out_(8 * at.s),
      c_(q.formula.c),
      r_(at.N),
      end_in_(at.end_size()),
      end_out_(2 * at.N + at.n + 2),
      shift_(at.N) {
  const IrkFormula& f = q.formula;
  while (stages_.size() * lanes < at_.s) stages_.emplace_back(lanes * at_.stage_size());
  c_.resize(stages_.size() * lanes, c_.back());
  c_.push_back(0);  // the beginning
  times_.resize(c_.size() * (1 + at_.u));
  lambda_.assign(lanes, f.gamma);
  std::copy(f.pairs.begin(), f.pairs.end(), lambda_.begin() + 1);
  struct Row {
    std::size_t lane;
    double sign;  ///< w₁ - i w₂
  };
  std::vector<Row> rows;
  if (f.has_real) rows.push_back({0, 1});
  for (std::size_t k = 1; k <= f.pairs.size(); ++k) rows.push_back({k, 1}), rows.push_back({lanes + k, -1});
  for (std::size_t j = 0; j < at_.s; ++j) {
    const auto J = static_cast<Eigen::Index>(j);
    for (std::size_t i = 0; i < at_.s; ++i) {
      const auto I = static_cast<Eigen::Index>(i);
      columns_.T_inverse.data()[8 * j + rows[i].lane] = rows[i].sign * f.T_inverse(I, J);
      columns_.T.data()[8 * j + i] = -rows[j].sign * f.T(I, J);
      columns_.W.data()[8 * j + i] = f.W(I, J);
      columns_.l.data()[8 * at_.s + i] = 1;
    }
    Z_at_.push_back(stage(j / lanes, at_.stage_Z()) + j % lanes);
    residual_at_.push_back(residual_.data() + j / lanes * lanes * at_.N + j % lanes);
    step_at_.push_back(solution_.data() + rows[j].lane);
  }
  past_at_.resize(at_.s + 1);
  double* const right = system(at_.right());
  products_.slopes = {{columns_.W.data(), Z_at_.data(), at_.s, lanes, at_.n}, all_stages(at_.stage_x())};
  products_.right = {{columns_.T_inverse.data(), residual_at_.data(), at_.s, lanes, at_.N},
                     {right, right + lanes, 2 * lanes}};
  products_.change = {{columns_.T.data(), step_at_.data(), at_.s, 2 * lanes, at_.N},
                      all_stages(at_.stage_Z())};
  products_.start = {{columns_.l.data(), past_at_.data(), at_.s + 1, 1, at_.N}, all_stages(at_.stage_Z())};
}

void CompiledNewtonStep::spread(std::size_t slot, double value) {
  for (std::size_t pass = 0; pass < stages_.size(); ++pass) std::fill_n(stage(pass, slot), lanes, value);
}

bool CompiledNewtonStep::factorise(const std::vector<double>& entries, double dt) {
  for (std::size_t l = 0; l < lanes; ++l) {
    system(0)[l] = lambda_[l].real() / dt;
    system(1)[l] = lambda_[l].imag() / dt;
  }
  for (std::size_t k = 0; k < entries.size(); ++k) std::fill_n(system(at_.jacobian() + k), lanes, entries[k]);
  machines_.factor->run(system_.data(), system(at_.factor()), work_.data());
  for (std::size_t k = 0; k < at_.factors; ++k) end_in_[at_.end_factor() + k] = *system(at_.factor() + 2 * k);
  const double* growth = system(at_.right() - 1);
  return std::all_of(growth, growth + lanes, [](double g) { return g <= 1; });  // false for NaN
}

void CompiledNewtonStep::begin(Problem& problem, double t, double dt, const double* y, const double* scale) {
  end_in_[0] = 1 / dt;
  for (std::size_t k = 0; k < at_.N; ++k) {
    spread(k, y[k]);
    r_[k] = 1 / scale[k];
  }
  std::copy_n(y, at_.N, end_in_.begin() + 1);
  std::copy_n(r_.begin(), at_.N, end_in_.begin() + static_cast<std::ptrdiff_t>(at_.end_r()));
  write_parameters(problem, end_in_.data() + at_.end_p());
  for (std::size_t k = 0; k < at_.p; ++k) spread(at_.stage_p() + k, end_in_[at_.end_p() + k]);
  spread(at_.stage_h(), end_in_[0]);
  write_stages(problem, c_, t, dt, times_.data());
  const double* time = times_.data();
  for (std::size_t i = 0; i < stages_.size() * lanes; ++i)
    for (std::size_t k = 0; k <= at_.u; ++k) stage(i / lanes, at_.stage_t() + k)[i % lanes] = *time++;
  std::copy_n(time, 1 + at_.u, end_in_.data() + at_.end_t());
}

void CompiledNewtonStep::predict(double ratio, const double* y, const double* Z) {
  std::fill_n(weigh_in_.data(), lanes, ratio);
  for (std::size_t pass = 0; pass < stages_.size(); ++pass) {
    std::copy_n(c_.begin() + static_cast<std::ptrdiff_t>(pass * lanes), lanes, weigh_in_.data() + lanes);
    machines_.weigh->run(weigh_in_.data(), weigh_out_.data(), work_.data());
    for (std::size_t j = 0; j < at_.s; ++j)
      std::copy_n(weigh_out_.data() + j * lanes, lanes, columns_.l.data() + 8 * j + pass * lanes);
  }
  for (std::size_t k = 0; k < at_.N; ++k) shift_[k] = y[k] - end_in_[1 + k];  // the polynomials sum to 1
  for (std::size_t j = 0; j < at_.s; ++j) past_at_[j] = Z + j * at_.N;
  past_at_.back() = shift_.data();
  codegen::assign_lane_product(products_.start.terms, products_.start.to);
}

void CompiledNewtonStep::set(const double* Z) {
  for (std::size_t i = 0; i < at_.s; ++i)
    for (std::size_t k = 0; k < at_.N; ++k) stage(i / lanes, at_.stage_Z() + k)[i % lanes] = Z[i * at_.N + k];
}

void CompiledNewtonStep::iterate(double& sum, double& largest) {
  codegen::assign_lane_product(products_.slopes.terms, products_.slopes.to);
  for (std::size_t pass = 0; pass < stages_.size(); ++pass)
    machines_.residuals->run(stage(pass, 0), residual_.data() + pass * lanes * at_.N, work_.data());
  codegen::assign_lane_product(products_.right.terms, products_.right.to);
  machines_.solve->run(system_.data(), solution_.data(), work_.data());
  codegen::add_lane_product(products_.change.terms, r_.data(), products_.change.to, sum, largest);
}

CompiledNewtonStep::End CompiledNewtonStep::end() {
  double* const Z = end_in_.data() + at_.end_Z();
  for (std::size_t i = 0; i < at_.s; ++i)
    for (std::size_t k = 0; k < at_.N; ++k) Z[i * at_.N + k] = Z_at_[i][k * lanes];
  machines_.end->run(end_in_.data(), end_out_.data(), work_.data());
  const double *error = end_out_.data(), *y = error + at_.N, *xdot = y + at_.N, *norm = xdot + at_.n;
  return {error, Z, y, xdot, norm[0], norm[1]};
}

CompiledNewtonStep::End CompiledNewtonStep::end_at(const double* y) {
  std::copy_n(end_in_.begin() + 1, at_.N, shift_.begin());
  std::copy_n(y, at_.N, end_in_.begin() + 1);
  const End result = end();
  std::copy_n(shift_.begin(), at_.N, end_in_.begin() + 1);
  return result;
}

}  // namespace pendula::integrate
