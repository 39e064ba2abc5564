#include "integrate/compiled/rosenbrock_step.hpp"

#include <algorithm>
#include <bit>

#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

using Slots = std::vector<Slot>;
using Request = CompiledRosenbrockStep::Request;

/// The nodes at which the equations are evaluated, in units of the step size: beginning, stages, end.
std::vector<double> nodes_of(const Rosenbrock& method) {
  std::vector<double> c{0, 1};
  for (double alpha : method.alpha())
    if (std::find(c.begin(), c.end(), alpha) == c.end()) c.push_back(alpha);
  return c;
}

/// Writes the program. In: h | y | p | atol | rtol | (t, u) of every node | ∂F/∂t if there are inputs.
class RosenbrockEmitter {
 public:
  struct Layout {
    std::size_t N, p, atol, stages, slope, end;
    explicit Layout(const Request& q)
        : N(static_cast<std::size_t>(q.problem.n() + q.problem.m())),
          p(1 + N),
          atol(p + parameter_count(q.problem)),
          stages(atol + 2 * N),
          slope(stages + nodes_of(q.method).size() * (1 + input_count(q.problem))),
          end(slope + (input_count(q.problem) > 0 ? N : 0)) {}
  };

  explicit RosenbrockEmitter(const Request& request)
      : q_(request),
        rk_(request.method),
        model_(request.problem.model()),
        at_(request),
        n_(model_.x.size()),
        N_(at_.N),
        nodes_(nodes_of(request.method)),
        w_(at_.end),
        h_(w_.input(0)),
        inverse_h_(w_.put(Op::div, w_.constant(1), h_)),
        y_(inputs_from(w_, 1, N_)),
        at_rest_(n_, w_.constant(0)),
        F_(codegen::lower(model_.F, q_.problem.arguments())) {}

  /// Out: y₁ | x₁′ | scaled error | K₁ … Kᵣ | right side of the error | sum and maximum of squares | growth.
  Program step() {
    Slot growth = 0;
    const Slots factors = factorise(growth);
    slopes_in_time();
    Table rights;
    for (int i = 0; i < rk_.stages(); ++i) {
      rights.push_back(right(i));
      U_.push_back(q_.pivots.write_solution(w_, factors, rights.back(), false));
    }
    const Slots end = point(numbers(rk_.m()));
    Table dense;
    for (Eigen::Index r = 0; r < rk_.dense().rows(); ++r) {
      dense.emplace_back();
      for (std::size_t k = 0; k < N_; ++k) dense.back().push_back(sum(numbers(rk_.dense().row(r)), U_, k));
    }
    Slots results = end, squares;
    append(results, velocity(end, dense));
    for (std::size_t k = 0; k < N_; ++k) {
      results.push_back(w_.put(Op::mul, sum(numbers(*rk_.e()), U_, k), weight(end, k)));
      squares.push_back(w_.put(Op::mul, results.back(), results.back()));
    }
    for (const Slots& row : dense) append(results, row);
    for (std::size_t k = 0; k < N_; ++k) results.push_back(sum(numbers(*rk_.e()), rights, k));
    results.push_back(w_.sum(squares));
    results.push_back(w_.largest(squares));
    results.push_back(growth);
    return w_.finish(std::move(results));
  }

 private:
  using Table = std::vector<Slots>;

  template <class Vector>
  static std::vector<double> numbers(const Vector& v) {
    std::vector<double> list;
    for (Eigen::Index i = 0; i < v.size(); ++i) list.push_back(v(i));
    return list;
  }
  static void append(Slots& list, const Slots& more) { list.insert(list.end(), more.begin(), more.end()); }

  /// The arguments of the equations at a node.
  Slots arguments_at(double node, std::span<const Slot> y, std::span<const Slot> xdot) const {
    const auto which = std::find(nodes_.begin(), nodes_.end(), node) - nodes_.begin();
    const std::size_t nu = input_count(q_.problem);
    const std::size_t time = at_.stages + static_cast<std::size_t>(which) * (1 + nu);
    const Slots u = inputs_from(w_, time + 1, nu), p = inputs_from(w_, at_.p, parameter_count(q_.problem));
    return arguments(w_.input(time), {y.first(n_), xdot, y.subspan(n_), u, p});
  }
  Slots beginning(std::span<const Expr> list) {
    return w_.inlined(codegen::lower(list, q_.problem.arguments()), arguments_at(0, y_, at_rest_));
  }

  Slots factorise(Slot& growth) {
    Slots entries = beginning(q_.problem.partials());
    const Slot factor = w_.put(Op::mul, w_.constant(1 / rk_.gamma()), inverse_h_);
    for (std::size_t k = 0; k < entries.size(); ++k)
      if (q_.in_mass[k]) entries[k] = w_.put(Op::mul, factor, entries[k]);
    Slots varying;  // 0, or NaN where the Jacobian is not finite, so that the step is rejected
    for (Slot entry : entries)
      if (!w_.is_constant(entry)) varying.push_back(w_.put(Op::mul, entry, w_.constant(0)));
    const Slots factors = q_.pivots.write_factors(w_, entries, false, growth);
    if (!varying.empty()) growth = w_.put(Op::add, growth, w_.sum(varying));
    return factors;
  }
  void slopes_in_time() {
    if (input_count(q_.problem) > 0) {
      slope_ = inputs_from(w_, at_.slope, N_);
      return;
    }
    std::vector<Expr> slopes;
    for (Expr e : model_.F) slopes.push_back(partial(e, time_symbol()));
    if (std::all_of(slopes.begin(), slopes.end(), [](Expr e) { return e.is_zero(); })) return;
    slope_ = beginning(slopes);
    for (Slot& entry : slope_) entry = w_.put(Op::mul, entry, h_);
  }

  /// Σ factorsⱼ vectorsⱼ, component k.
  Slot sum(std::vector<double> factors, const Table& vectors, std::size_t k) {
    Slots terms;
    for (const Slots& u : vectors) terms.push_back(u[k]);
    factors.resize(terms.size());
    return w_.combination(factors, terms);
  }
  Slots point(const std::vector<double>& factors) {
    Slots result;
    for (std::size_t k = 0; k < N_; ++k) result.push_back(w_.put(Op::add, y_[k], sum(factors, U_, k)));
    return result;
  }
  /// The right side of stage i (rosenbrock_stepper.hpp).
  Slots right(int i) {
    std::vector<double> c = numbers(rk_.C().row(i).head(i));
    for (double& factor : c) factor = -factor;
    Slots xdot = at_rest_;
    for (std::size_t k = 0; k < n_ && i > 0; ++k) xdot[k] = w_.put(Op::mul, sum(c, U_, k), inverse_h_);
    const Slots y = i == 0 ? y_ : point(numbers(rk_.A().row(i).head(i)));
    Slots result = w_.inlined(F_, arguments_at(rk_.alpha()[i], y, xdot));
    for (std::size_t k = 0; k < N_; ++k) {
      result[k] = w_.put(Op::neg, result[k]);
      if (slope_.empty() || rk_.gammas()[i] == 0) continue;
      result[k] = w_.put(Op::sub, result[k], w_.put(Op::mul, w_.constant(rk_.gammas()[i]), slope_[k]));
    }
    return result;
  }
  Slot weight(const Slots& end, std::size_t k) {
    const Slot size = w_.put(Op::max, w_.put(Op::abs, y_[k]), w_.put(Op::abs, end[k]));
    const Slot scale =
        w_.put(Op::add, w_.input(at_.atol + k), w_.put(Op::mul, w_.input(at_.atol + N_ + k), size));
    return w_.put(Op::div, w_.constant(1), scale);
  }
  /// x₁′: from the equations if M is a permuted diagonal matrix, else from the dense output.
  Slots velocity(const Slots& end, const Table& dense) {
    const std::vector<Entry> M = sparse_jacobian(model_.F, model_.xdot);
    std::vector<int> rows(N_, 0), columns(n_, 0);
    std::vector<Expr> entries;
    for (const Entry& e : M) ++rows[e.row], ++columns[e.column], entries.push_back(e.value);
    const bool diagonal = std::count(columns.begin(), columns.end(), 1) == static_cast<std::ptrdiff_t>(n_) &&
                          *std::max_element(rows.begin(), rows.end()) <= 1;
    Slots result(n_);
    if (diagonal) {
      const Slots g = w_.inlined(F_, arguments_at(1, end, at_rest_)), mass = beginning(entries);
      for (std::size_t e = 0; e < M.size(); ++e)
        result[M[e].column] = w_.put(Op::neg, w_.put(Op::div, g[M[e].row], mass[e]));
      return result;
    }
    for (std::size_t k = 0; k < n_; ++k) {
      Slot slope = w_.put(Op::sub, end[k], y_[k]);
      for (const Slots& row : dense) slope = w_.put(Op::sub, slope, row[k]);
      result[k] = w_.put(Op::mul, slope, inverse_h_);
    }
    return result;
  }

  const Request& q_;
  const Rosenbrock& rk_;
  const dae::FirstOrder& model_;
  Layout at_;
  std::size_t n_, N_;
  std::vector<double> nodes_;
  Writer w_;
  Slot h_, inverse_h_;
  Slots y_, at_rest_, slope_;  ///< slope: h ∂F/∂t, empty where it is 0
  Table U_;
  Program F_;
};

Key key_of(const Request& q) {
  const Rosenbrock& method = q.method;
  Key key{2, static_cast<std::uint32_t>(method.stages())};
  add(key, q.problem.model().F);
  add(key, q.problem.arguments());
  add(key, method.gamma());
  for (int i = 0; i < method.stages(); ++i) {
    for (int j = 0; j < i; ++j) {
      add(key, method.A()(i, j));
      add(key, method.C()(i, j));
    }
    add(key, method.m()[i]);
    add(key, (*method.e())[i]);
  }
  for (double d : method.dense().reshaped()) add(key, d);
  add(key, std::bit_cast<double>(reinterpret_cast<std::uint64_t>(q.pivots.pivots().get())));
  return key;
}

}  // namespace

std::shared_ptr<CompiledRosenbrockStep> CompiledRosenbrockStep::make(const Request& q) {
  if (!Machine::available()) return nullptr;
  const auto stages = static_cast<std::size_t>(q.method.stages());
  if (q.pivots.instructions() * stages > 4 * longest_step_program) return nullptr;
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key_of(q));
  if (entry->wanted++ == 0) {
    entry->kept = {q.pivots.pivots()};
    if (Program program = RosenbrockEmitter(q).step(); program.instructions.size() <= longest_step_program)
      entry->keep_if_complete({Machine::compile(program, 1, codegen::Rounding::fused)});
  }
  if (entry->machines.empty()) return nullptr;
  const RosenbrockEmitter::Layout at(q);
  auto code = std::make_shared<CompiledRosenbrockStep>();
  code->machine_ = entry->machines[0];
  code->c_ = nodes_of(q.method);
  code->n_ = static_cast<std::size_t>(q.problem.n());
  code->N_ = at.N;
  code->stages_ = at.stages;
  code->slope_ = at.slope;
  code->in_.resize(at.end);
  code->out_.resize(at.N * (3 + static_cast<std::size_t>(q.method.dense().rows())) + code->n_ + 3);
  code->work_.resize(code->machine_->workspace_size());
  double* const weights = code->in_.data() + at.atol;
  std::copy_n(q.tolerances.rtol.data(), at.N, std::copy_n(q.tolerances.atol.data(), at.N, weights));
  return code;
}

CompiledRosenbrockStep::End CompiledRosenbrockStep::run(Problem& problem, const Point& from, double dt,
                                                        const double* slope) {
  double* to = in_.data();
  *to++ = dt;
  to = std::copy_n(from.x.data(), problem.n(), to);
  to = std::copy_n(from.z.data(), problem.m(), to);
  write_parameters(problem, to);
  write_stages(problem, c_, from.t, dt, in_.data() + stages_);
  for (std::size_t k = 0; slope_ + k < in_.size(); ++k) in_[slope_ + k] = dt * slope[k];
  machine_->run(in_.data(), out_.data(), work_.data());
  const double *y = out_.data(), *xdot = y + N_, *scaled = xdot + n_, *dense = scaled + N_;
  const double* norms = out_.data() + out_.size() - 3;
  return {y, xdot, scaled, dense, norms - N_, norms[0], norms[1], norms[2] <= 1};
}

}  // namespace pendula::integrate
