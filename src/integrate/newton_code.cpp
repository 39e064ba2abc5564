#include "integrate/newton_code.hpp"

#include <algorithm>
#include <bit>

#include "expr/derivative.hpp"
#include "integrate/step_programs.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

/// ∂F/∂x′, if it depends on parameters alone.
struct Mass {
  std::vector<Entry> entries;
  bool constant = false;

  explicit Mass(const dae::FirstOrder& model) : entries(sparse_jacobian(model.F, model.xdot)) {
    std::vector<Expr> values;
    for (const Entry& entry : entries) values.push_back(entry.value);
    const std::vector<Expr> within = leaves(values);
    constant = std::all_of(within.begin(), within.end(), [&](Expr leaf) {
      return std::find(model.p.begin(), model.p.end(), leaf) != model.p.end();
    });
  }
};

}  // namespace

// In: 1/h | y | 1/scale | p | (t, u) of every stage and of the beginning | factors, real, complex | state: w
// if the mass is constant, Z.
NewtonCode::Layout::Layout(const Request& request, bool constant_mass) {
  const Problem& problem = request.problem;
  const auto N = static_cast<std::size_t>(problem.n() + problem.m()), s = request.formula.c.size();
  n = static_cast<std::size_t>(problem.n());
  y = 1, r = y + N, p = r + N, stages = p + parameter_count(problem);
  factors = stages + (s + 1) * (1 + input_count(problem));
  state = factors + request.real->factor_count() + 1;  // and their growth
  for (const auto* pair : request.complex) state += pair->factor_count();
  Z = state + (constant_mass ? s * N : 0);
  end = Z + s * N;
}

/// Writes the programs.
class NewtonCode::Programs {
 public:
  explicit Programs(const Request& request)
      : q_(request),
        f_(request.formula),
        mass_(request.problem.model()),
        at_(request, mass_.constant),
        n_(at_.n),
        N_(at_.r - at_.y),
        s_(f_.c.size()) {
    const auto& model = q_.problem.model();
    F_ = codegen::lower(model.F, q_.problem.arguments());
    if (!mass_.constant) return;
    Substitution at_rest;
    for (Expr xdot : model.xdot) at_rest[xdot] = Expr(0);
    g_ = codegen::lower(substitute(model.F, at_rest), q_.problem.arguments());
    std::vector<Expr> values;
    for (const Entry& entry : mass_.entries) values.push_back(entry.value);
    M_ = codegen::lower(values, q_.problem.arguments());
  }
  const Layout& layout() const { return at_; }

  /// In: 1/h | entries of the Jacobian. Out: what stands at Layout::factors.
  Program factor() const {
    Writer w(1 + q_.in_mass.size());
    const auto entries = inputs_from(w, 1, q_.in_mass.size());
    const auto scaled = [&](double factor, std::size_t k) {
      return w.put(Op::mul, w.put(Op::mul, w.constant(factor), w.input(0)), entries[k]);
    };
    std::vector<Slot> values, results, growths;
    const auto factorise = [&](const codegen::StraightLU& lu) {
      growths.emplace_back();
      const auto factors = lu.write_factors(w, values, growths.back());
      results.insert(results.end(), factors.begin(), factors.end());
      values.clear();
    };
    for (std::size_t k = 0; k < entries.size(); ++k)
      values.push_back(q_.in_mass[k] ? scaled(f_.gamma, k) : entries[k]);
    factorise(*q_.real);
    for (std::size_t pair = 0; pair < q_.complex.size(); ++pair) {
      for (std::size_t k = 0; k < entries.size(); ++k) {
        values.push_back(q_.in_mass[k] ? scaled(f_.pairs[pair].real(), k) : entries[k]);
        values.push_back(q_.in_mass[k] ? scaled(f_.pairs[pair].imag(), k) : w.constant(0));
      }
      factorise(*q_.complex[pair]);
    }
    results.push_back(w.sum(growths));  // a maximum may lose what is not a number
    return w.finish(std::move(results));
  }

  /// In: ratio | y of the last step | y | its Z. Out: the state.
  Program predict() const {
    Writer w(1 + 2 * N_ + s_ * N_);
    const Table old = rows(w, 1 + 2 * N_);
    Table Z(s_);
    for (std::size_t i = 0; i < s_; ++i) {
      const Slot theta = w.put(Op::add, w.constant(1), w.put(Op::mul, w.constant(f_.c[i]), w.input(0)));
      const std::vector<Slot> l = lagrange(w, theta);
      for (std::size_t k = 0; k < N_; ++k) {
        Slot sum = w.put(Op::sub, w.input(1 + k), w.input(1 + N_ + k));  // the polynomials add up to 1
        for (std::size_t j = 0; j < s_; ++j) sum = w.put(Op::add, sum, w.put(Op::mul, l[j + 1], old[j][k]));
        Z[i].push_back(sum);
      }
    }
    std::vector<Slot> results;
    for (std::size_t i = 0; i < s_ && mass_.constant; ++i)
      for (std::size_t k = 0; k < N_; ++k) results.push_back(mixed(w, row_of(f_.T_inverse, i), Z, k));
    append(results, Z);
    return w.finish(std::move(results));
  }

  /// Out: the new state, sum and largest.
  Program iterate() const {
    Writer w(at_.end);
    Table unknown = rows(w, at_.state), Z = rows(w, at_.Z);
    const Table step = steps(w, residuals(w, unknown, Z));
    std::vector<Slot> results, squares;
    for (std::size_t i = 0; i < s_; ++i)
      for (std::size_t k = 0; k < N_; ++k) {
        if (mass_.constant) unknown[i][k] = w.put(sign(i) < 0 ? Op::add : Op::sub, unknown[i][k], step[i][k]);
        const Slot change = mixed(w, signed_row(f_.T, i), step, k);
        Z[i][k] = w.put(Op::add, Z[i][k], change);
        const Slot scaled = w.put(Op::mul, change, w.input(at_.r + k));
        squares.push_back(w.put(Op::mul, scaled, scaled));
      }
    if (mass_.constant) append(results, unknown);
    append(results, Z);
    results.push_back(w.sum(squares)), results.push_back(w.largest(squares));
    return w.finish(std::move(results));
  }

  /// Out: error | Z | y₁ | x₁′ | sum and largest.
  Program end() const {
    Writer w(at_.end);
    const Table Z = rows(w, at_.Z);
    const auto y = inputs_from(w, at_.y, N_);
    std::vector<double> e(f_.error.begin(), f_.error.end()), slopes(s_ + 1);
    for (double& factor : e) factor = -factor;
    std::vector<Slot> velocity;
    for (std::size_t k = 0; k < n_; ++k) velocity.push_back(w.put(Op::mul, mixed(w, e, Z, k), w.input(0)));
    std::vector<Slot> F = equations(w, F_, s_, y, velocity);
    for (std::size_t k = 0; k < N_; ++k) F[k] = q_.bare[k] ? w.constant(0) : w.put(Op::neg, F[k]);
    std::vector<Slot> results =
        q_.real->write_solution(w, inputs_from(w, at_.factors, q_.real->factor_count()), F);
    std::vector<Slot> squares;
    for (std::size_t k = 0; k < N_; ++k) {
      const Slot scaled = w.put(Op::mul, results[k], w.input(at_.r + k));
      squares.push_back(w.put(Op::mul, scaled, scaled));
    }
    append(results, Z);
    for (std::size_t k = 0; k < N_; ++k)
      results.push_back(w.put(Op::add, y[k], mixed(w, {f_.end.begin(), f_.end.end()}, Z, k)));
    f_.lagrange_slopes(1, slopes.data());
    slopes.erase(slopes.begin());
    if (f_.stiffly_accurate) slopes = row_of(f_.W, s_ - 1);
    for (std::size_t k = 0; k < n_; ++k)
      results.push_back(w.put(Op::mul, mixed(w, slopes, Z, k), w.input(0)));
    results.push_back(w.sum(squares)), results.push_back(w.largest(squares));
    return w.finish(std::move(results));
  }

 private:
  using Table = std::vector<std::vector<Slot>>;  ///< stage (or row of T⁻¹), component

  std::vector<double> row_of(const Mat& A, std::size_t i) const {
    return integrate::row_of(A, static_cast<int>(i), static_cast<int>(s_));
  }
  Table rows(const Writer& w, std::size_t first) const {
    Table table;
    for (std::size_t i = 0; i < s_; ++i) table.push_back(inputs_from(w, first + i * N_, N_));
    return table;
  }
  static Slot mixed(Writer& w, const std::vector<double>& factors, const Table& table, std::size_t k) {
    std::vector<Slot> terms;
    for (const auto& row : table) terms.push_back(row[k]);
    return w.combination(factors, terms);
  }
  static void append(std::vector<Slot>& list, const Table& table) {
    for (const auto& row : table) list.insert(list.end(), row.begin(), row.end());
  }
  /// (Λ w)/h, component k: T⁻¹ W T = Λ is block diagonal.
  std::vector<Slot> turned(Writer& w, const Table& unknown, std::size_t k) const {
    std::vector<Slot> result;
    const Slot h = w.input(0);
    const auto scaled = [&](double factor) { return w.put(Op::mul, w.constant(factor), h); };
    if (f_.has_real) result.push_back(w.put(Op::mul, scaled(f_.gamma), unknown[0][k]));
    for (const auto& pair : f_.pairs) {
      const Slot alpha = scaled(pair.real()), beta = scaled(pair.imag());
      const Slot first = unknown[result.size()][k], second = unknown[result.size() + 1][k];
      result.push_back(w.put(Op::add, w.put(Op::mul, alpha, first), w.put(Op::mul, beta, second)));
      result.push_back(w.put(Op::sub, w.put(Op::mul, alpha, second), w.put(Op::mul, beta, first)));
    }
    return result;
  }
  /// What stands in the equations of stage i, or at the beginning, i = s: y, and x′ where it does.
  std::vector<Slot> equations(Writer& w, const Program& program, std::size_t i, std::span<const Slot> y,
                              std::span<const Slot> xdot) const {
    const std::size_t nu = input_count(q_.problem), time = at_.stages + i * (1 + nu);
    const auto p = inputs_from(w, at_.p, parameter_count(q_.problem));
    return w.inlined(program, arguments(w.input(time),
                                        {y.first(n_), xdot, y.subspan(n_), inputs_from(w, time + 1, nu), p}));
  }
  /// Of the right sides: -r for the real system, -(r₁ - i r₂) for a pair; its solution is Δw₁ - i Δw₂.
  double sign(std::size_t row) const {
    const std::size_t first_pair = f_.has_real ? 1 : 0;
    return row >= first_pair && (row - first_pair) % 2 == 1 ? 1 : -1;
  }
  /// Row i of T for solutions.
  std::vector<double> signed_row(const Mat& T, std::size_t i) const {
    std::vector<double> row = row_of(T, i);
    for (std::size_t j = 0; j < s_; ++j) row[j] *= -sign(j);
    return row;
  }
  /// ± (T⁻¹ ⊗ I) R, the right sides.
  Table residuals(Writer& w, const Table& unknown, const Table& Z) const {
    const std::vector<Slot> at_rest(n_, w.constant(0));
    Table R;
    for (std::size_t i = 0; i < s_; ++i) {
      std::vector<Slot> y, slope;
      for (std::size_t k = 0; k < N_; ++k) y.push_back(w.put(Op::add, w.input(at_.y + k), Z[i][k]));
      for (std::size_t k = 0; k < n_ && !mass_.constant; ++k)
        slope.push_back(w.put(Op::mul, mixed(w, row_of(f_.W, i), Z, k), w.input(0)));
      R.push_back(mass_.constant ? equations(w, g_, i, y, at_rest) : equations(w, F_, i, y, slope));
    }
    Table result(s_);
    for (std::size_t i = 0; i < s_; ++i) {
      std::vector<double> factors = row_of(f_.T_inverse, i);
      for (double& factor : factors) factor *= sign(i);
      for (std::size_t k = 0; k < N_; ++k) result[i].push_back(mixed(w, factors, R, k));
    }
    if (mass_.constant) add_mass(w, unknown, result);
    return result;
  }
  /// ± (Λ ⊗ M) w / h
  void add_mass(Writer& w, const Table& unknown, Table& result) const {
    Table turned_w;  // component, row
    for (std::size_t k = 0; k < n_; ++k) turned_w.push_back(turned(w, unknown, k));
    const std::vector<Slot> nothing(N_, w.constant(0));
    const std::span<const Slot> none(nothing);
    const auto M = equations(w, M_, s_, none, none.first(n_));
    for (std::size_t e = 0; e < M.size(); ++e)
      for (std::size_t i = 0; i < s_; ++i) {
        Slot& sum = result[i][static_cast<std::size_t>(mass_.entries[e].row)];
        const Slot factor = turned_w[static_cast<std::size_t>(mass_.entries[e].column)][i];
        sum = w.put(sign(i) < 0 ? Op::sub : Op::add, sum, w.put(Op::mul, M[e], factor));
      }
  }
  /// The solutions for these right sides, rows like those of w.
  Table steps(Writer& w, const Table& right) const {
    Table result;
    std::size_t at = at_.factors;
    const auto solve = [&](const codegen::StraightLU& lu, const std::vector<Slot>& b) {
      const auto x = lu.write_solution(w, inputs_from(w, at, lu.factor_count()), b);
      at += lu.factor_count();
      return x;
    };
    if (f_.has_real) {
      result.push_back(solve(*q_.real, right[0]));
    } else {
      at += q_.real->factor_count();
    }
    for (const auto* lu : q_.complex) {
      const auto &first = right[result.size()], &second = right[result.size() + 1];
      std::vector<Slot> b, re, im;
      for (std::size_t k = 0; k < N_; ++k) b.push_back(first[k]), b.push_back(second[k]);
      const auto x = solve(*lu, b);
      for (std::size_t k = 0; k < N_; ++k) re.push_back(x[2 * k]), im.push_back(x[2 * k + 1]);
      result.push_back(std::move(re)), result.push_back(std::move(im));
    }
    return result;
  }
  std::vector<Slot> lagrange(Writer& w, Slot theta) const {
    std::vector<Slot> distance, l(f_.nodes.size());
    for (double node : f_.nodes)
      distance.push_back(node == 0 ? theta : w.put(Op::sub, theta, w.constant(node)));
    for (std::size_t j = 0; j < l.size(); ++j) {
      l[j] = w.constant(f_.barycentric[j]);
      for (std::size_t k = 0; k < l.size(); ++k)
        if (k != j) l[j] = w.put(Op::mul, l[j], distance[k]);
    }
    return l;
  }

  const Request& q_;
  const IrkFormula& f_;
  Mass mass_;
  Layout at_;
  std::size_t n_, N_, s_;
  Program F_, g_, M_;  ///< F; F with x′ = 0; ∂F/∂x′
};

std::shared_ptr<NewtonCode> NewtonCode::make(const Request& request, long iterations, bool now) {
  constexpr long enough = 100;
  if (!Machine::available()) return nullptr;
  const Problem& problem = request.problem;
  Key key{1, static_cast<std::uint32_t>(request.formula.s)};
  add(key, problem.model().F), add(key, problem.arguments());
  for (double c : request.formula.c) add(key, c);
  for (char bare : request.bare) key.push_back(static_cast<std::uint32_t>(bare));
  std::vector<std::shared_ptr<const void>> pivots{request.real->pivots()};
  for (const auto* lu : request.complex) pivots.push_back(lu->pivots());
  for (const auto& pivot : pivots)
    add(key, std::bit_cast<double>(reinterpret_cast<std::uint64_t>(pivot.get())));
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key);
  if (entry->wanted < 0) return nullptr;  // too long
  if (entry->machines.empty()) {
    entry->wanted += iterations;
    entry->kept = pivots;
    if (!now && entry->wanted < enough) return nullptr;
    const Programs programs(request);
    const Program iterate = programs.iterate();
    entry->wanted = -1;
    if (iterate.instructions.size() > longest_step_program) return nullptr;
    for (const Program& program : {programs.factor(), programs.predict(), iterate, programs.end()})
      entry->machines.push_back(Machine::compile(program, 1, codegen::Rounding::fused));
    entry->constant_mass = programs.layout().Z > programs.layout().state;
    entry->wanted = 0;
  }
  const Layout at(request, entry->constant_mass);
  std::shared_ptr<NewtonCode> code(new NewtonCode(at, request.formula));
  code->factor_ = entry->machines[0], code->predict_ = entry->machines[1];
  code->iterate_ = entry->machines[2], code->end_ = entry->machines[3];
  code->c_ = request.formula.c;
  code->c_.push_back(0);  // the beginning
  code->in_.resize(at.end);
  const std::size_t N = at.r - at.y, stages = at.end - at.Z;
  code->out_.resize(2 * stages + 3 * N + 2);
  code->matrix_.resize(1 + request.in_mass.size());
  code->past_.resize(1 + 2 * N + stages);
  std::size_t work = 0;
  for (const auto& machine : entry->machines) work = std::max(work, machine->workspace_size());
  code->work_.resize(work);
  return code;
}

bool NewtonCode::factorise(const std::vector<double>& entries, double dt) {
  matrix_[0] = 1 / dt;
  std::copy(entries.begin(), entries.end(), matrix_.begin() + 1);
  factor_->run(matrix_.data(), in_.data() + at_.factors, work_.data());
  return in_[at_.state - 1] <= 1;  // the growth of the pivots; false for NaN
}

void NewtonCode::begin(Problem& problem, double t, double dt, const double* y, const double* scale) {
  const std::size_t N = at_.r - at_.y;
  in_[0] = 1 / dt;
  std::copy_n(y, N, in_.data() + at_.y);
  for (std::size_t k = 0; k < N; ++k) in_[at_.r + k] = 1 / scale[k];
  write_parameters(problem, in_.data() + at_.p);
  write_stages(problem, c_, t, dt, in_.data() + at_.stages);
}

void NewtonCode::predict(double ratio, const double* y, const double* Z) {
  const std::size_t N = at_.r - at_.y;
  double* to = past_.data();
  *to++ = ratio;
  to = std::copy_n(y, N, to);
  to = std::copy_n(in_.data() + at_.y, N, to);
  std::copy_n(Z, at_.end - at_.Z, to);
  predict_->run(past_.data(), in_.data() + at_.state, work_.data());
}

void NewtonCode::set(const double* Z) {
  const auto N = static_cast<Eigen::Index>(at_.r - at_.y), s = T_inverse_.rows();
  std::copy_n(Z, N * s, in_.data() + at_.Z);
  if (at_.Z > at_.state)
    Eigen::Map<Mat>(in_.data() + at_.state, N, s) = Eigen::Map<const Mat>(Z, N, s) * T_inverse_.transpose();
}

void NewtonCode::iterate(double& sum, double& largest) {
  iterate_->run(in_.data(), out_.data(), work_.data());
  const std::size_t size = at_.end - at_.state;
  std::copy_n(out_.begin(), size, in_.begin() + static_cast<std::ptrdiff_t>(at_.state));
  sum = out_[size], largest = out_[size + 1];
}

NewtonCode::End NewtonCode::end() {
  end_->run(in_.data(), out_.data(), work_.data());
  const std::size_t N = at_.r - at_.y, size = at_.end - at_.Z;
  const double* error = out_.data();
  const double* Z = error + N;
  const double* y = Z + size;
  const double* xdot = y + N;
  const double* norm = xdot + at_.n;
  return {error, Z, y, xdot, norm[0], norm[1]};
}

NewtonCode::End NewtonCode::end_at(const double* y) {
  const std::size_t N = at_.r - at_.y;
  const std::vector<double> before(in_.data() + at_.y, in_.data() + at_.r);
  std::copy_n(y, N, in_.data() + at_.y);
  const End result = end();
  std::copy(before.begin(), before.end(), in_.data() + at_.y);
  return result;
}

}  // namespace pendula::integrate
