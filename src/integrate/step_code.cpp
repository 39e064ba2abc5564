#include "integrate/step_code.hpp"

#include <algorithm>
#include <bit>
#include <mutex>

#include "codegen/memory.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

constexpr std::size_t longest = 6000;  // instructions, 1 ms to compile: beyond, the equations dominate

void add(Key& key, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  key.push_back(static_cast<std::uint32_t>(bits)), key.push_back(static_cast<std::uint32_t>(bits >> 32));
}
void add(Key& key, std::span<const Expr> list) {
  key.push_back(static_cast<std::uint32_t>(list.size()));
  for (Expr e : list) key.push_back(e.id());
}

/// What was compiled, or how often it was wanted so far.
struct Entry {
  std::shared_ptr<const Machine> machine;
  long wanted = 0;
  std::vector<std::shared_ptr<const void>> kept;  ///< whose addresses are in the key
};

struct Store {
  std::mutex mutex;
  codegen::Memory<Entry> entries;
  std::shared_ptr<Entry> entry(const Key& key) {
    auto found = entries.find(key);
    if (!found) entries.add(key, found = std::make_shared<Entry>(), 1000);
    return found;
  }
};
Store& store() {
  static Store store;
  return store;
}

std::vector<Slot> inputs_from(const Writer& w, std::size_t first, std::size_t count) {
  std::vector<Slot> list;
  for (std::size_t k = 0; k < count; ++k) list.push_back(w.input(first + k));
  return list;
}

std::vector<double> row_of(const Mat& A, int i, int count) {
  std::vector<double> row;
  for (int j = 0; j < count; ++j) row.push_back(A(i, j));
  return row;
}

/// Arguments [t, x, x′, z, u, p] of a kernel.
std::vector<Slot> arguments(Slot t, std::initializer_list<std::span<const Slot>> groups) {
  std::vector<Slot> list{t};
  for (const auto& group : groups) list.insert(list.end(), group.begin(), group.end());
  return list;
}

std::size_t parameters(const Problem& problem) { return problem.model().p.size(); }
std::size_t inputs(const Problem& problem) { return problem.model().u.size(); }

/// t and u at every stage, behind one another.
void write_stages(Problem& problem, const std::vector<double>& c, std::size_t first, double t, double dt,
                  double* to) {
  const std::size_t count = inputs(problem);
  for (std::size_t i = first; i < c.size(); ++i) {
    *to++ = t + c[i] * dt;
    if (count == 0) continue;
    problem.set_time(t + c[i] * dt);
    to = std::copy_n(problem.values().end() - static_cast<std::ptrdiff_t>(count + parameters(problem)), count,
                     to);
  }
}

/// In: h | x | K₁ | p | (t, u) of stages 2 … s.
Program explicit_program(const Problem& problem, const Tableau& rk) {
  const auto n = static_cast<std::size_t>(problem.n()), nu = inputs(problem), np = parameters(problem);
  const int s = rk.stages();
  Writer w(1 + 2 * n + np + static_cast<std::size_t>(s - 1) * (1 + nu));
  const Slot h = w.input(0);
  const auto x = inputs_from(w, 1, n), p = inputs_from(w, 1 + 2 * n, np);
  std::vector<std::vector<Slot>> K{inputs_from(w, 1 + n, n)};
  const Program f = codegen::lower(problem.model().f, problem.arguments());
  const auto sum = [&](const std::vector<double>& factors, std::size_t k) {
    std::vector<Slot> terms;
    for (std::size_t j = 0; j < factors.size(); ++j) terms.push_back(K[j][k]);
    return w.put(Op::mul, h, w.combination(factors, terms));
  };
  std::vector<std::vector<double>> rows;
  std::vector<std::vector<Slot>> X;
  const auto point = [&](const std::vector<double>& factors) {
    for (std::size_t i = 0; i < rows.size(); ++i)  // the last stage of a method "first same as last"
      if (std::equal(rows[i].begin(), rows[i].end(), factors.begin()) &&
          std::all_of(factors.begin() + static_cast<std::ptrdiff_t>(rows[i].size()), factors.end(),
                      [](double b) { return b == 0; }))
        return X[i];
    rows.push_back(factors), X.emplace_back();
    for (std::size_t k = 0; k < n; ++k) X.back().push_back(w.put(Op::add, x[k], sum(factors, k)));
    return X.back();
  };
  std::vector<Slot> time;  // what belongs to a stage, equal for stages at the same time
  std::vector<std::vector<Slot>> u;
  for (int i = 1; i < s; ++i) {
    int first = 1;
    while (rk.c()[first] != rk.c()[i]) ++first;
    const std::size_t at = 1 + 2 * n + np + static_cast<std::size_t>(first - 1) * (1 + nu);
    time.push_back(w.input(at)), u.push_back(inputs_from(w, at + 1, nu));
  }
  // What depends on time alone is known for all stages at once, and functions like sin are called while no
  // register holds anything.
  std::vector<bool> early(problem.arguments().size(), true);
  std::fill_n(early.begin() + 1, 2 * n, false);
  for (std::size_t i = 0; i < time.size(); ++i) w.inline_part(f, arguments(time[i], {x, x, u[i], p}), early);
  for (int i = 1; i < s; ++i) {
    const auto xi = point(row_of(rk.A(), i, i));
    const auto k = static_cast<std::size_t>(i - 1);
    K.push_back(w.inlined(f, arguments(time[k], {xi, xi, u[k], p})));  // f contains no x′
  }
  std::vector<Slot> results;
  for (int i = 1; i < s; ++i)
    results.insert(results.end(), K[static_cast<std::size_t>(i)].begin(),
                   K[static_cast<std::size_t>(i)].end());
  std::vector<double> b(rk.b().begin(), rk.b().end()), zero(b.size(), 0);
  const auto x1 = point(b);
  results.insert(results.end(), x1.begin(), x1.end());
  for (const auto& embedded : {rk.bhat(), rk.bhat2()}) {
    std::vector<double> e = zero;
    for (std::size_t j = 0; embedded && j < e.size(); ++j)
      e[j] = b[j] - (*embedded)[static_cast<Eigen::Index>(j)];
    for (std::size_t k = 0; k < n; ++k) results.push_back(embedded ? sum(e, k) : w.constant(0));
  }
  return w.finish(std::move(results));
}

}  // namespace

std::shared_ptr<ExplicitCode> ExplicitCode::make(const Problem& problem, const Tableau& rk) {
  if (!Machine::available() || !problem.is_ode() || problem.m() > 0) return nullptr;
  Key key{0, static_cast<std::uint32_t>(rk.stages())};
  add(key, problem.model().f), add(key, problem.arguments());
  for (int i = 0; i < rk.stages(); ++i) {
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    for (const auto& row :
         {std::optional<Vec>(rk.b()), std::optional<Vec>(rk.bhat()), std::optional<Vec>(rk.bhat2())})
      add(key, row ? (*row)[i] : 0);
  }
  const std::lock_guard lock(store().mutex);
  const auto entry = store().entry(key);
  if (!entry->machine && entry->wanted == 0) {
    entry->wanted = 1;
    if (Program program = explicit_program(problem, rk); program.instructions.size() <= longest)
      entry->machine = Machine::compile(program);
  }
  if (!entry->machine) return nullptr;
  auto code = std::make_shared<ExplicitCode>();
  code->machine_ = entry->machine;
  code->c_.assign(rk.c().begin(), rk.c().end());
  code->work_.resize(code->machine_->workspace_size());
  code->in_.resize(1 + 2 * static_cast<std::size_t>(problem.n()) + parameters(problem) +
                   static_cast<std::size_t>(rk.stages() - 1) * (1 + inputs(problem)));
  return code;
}

void ExplicitCode::run(Problem& problem, const Point& from, double dt, double* out) {
  double* to = in_.data();
  *to++ = dt;
  to = std::copy_n(from.x.data(), problem.n(), to);
  to = std::copy_n(from.xdot.data(), problem.n(), to);
  to = std::copy(problem.values().end() - static_cast<std::ptrdiff_t>(parameters(problem)),
                 problem.values().end(), to);
  write_stages(problem, c_, 1, from.t, dt, to);
  machine_->run(in_.data(), out, work_.data());
}

// In: 1/h | y | 1/scale | p | (t, u) of every stage | factors, real and complex | Z.
NewtonCode::Layout::Layout(const Problem& problem, int s, const codegen::StraightLU* lu,
                           const Complex& pairs) {
  const auto N = static_cast<std::size_t>(problem.n() + problem.m());
  y = 1, r = y + N, p = r + N, stages = p + parameters(problem);
  real = stages + static_cast<std::size_t>(s) * (1 + inputs(problem));
  complex = real + (lu ? lu->factors().size() : 0);
  Z = complex;
  for (const auto* pair : pairs) Z += pair->factors().size();
  end = Z + static_cast<std::size_t>(s) * N;
}

Program NewtonCode::program(const Problem& problem, const IrkFormula& formula, const Layout& at,
                            const codegen::StraightLU* real, const Complex& complex) {
  const auto n = static_cast<std::size_t>(problem.n()), N = n + static_cast<std::size_t>(problem.m());
  const auto nu = inputs(problem);
  const int s = formula.s;
  const auto size = static_cast<std::size_t>(s);
  Writer w(at.end);
  const Program F = codegen::lower(problem.model().F, problem.arguments());
  const auto Z = inputs_from(w, at.Z, size * N), p = inputs_from(w, at.p, parameters(problem));
  using Table = std::vector<std::vector<Slot>>;  // stage, component
  const auto mixed = [&](const std::vector<double>& factors, const Table& table, std::size_t k) {
    std::vector<Slot> terms;
    for (const auto& row : table) terms.push_back(row[k]);
    return w.combination(factors, terms);
  };
  Table stage(size), R;
  for (std::size_t i = 0; i < size; ++i)
    stage[i] = {Z.begin() + static_cast<std::ptrdiff_t>(i * N),
                Z.begin() + static_cast<std::ptrdiff_t>((i + 1) * N)};
  for (int i = 0; i < s; ++i) {
    std::vector<Slot> value, slope;
    for (std::size_t k = 0; k < N; ++k)
      value.push_back(w.put(Op::add, w.input(at.y + k), stage[static_cast<std::size_t>(i)][k]));
    for (std::size_t k = 0; k < n; ++k)
      slope.push_back(w.put(Op::mul, mixed(row_of(formula.W, i, s), stage, k), w.input(0)));
    const std::size_t time = at.stages + static_cast<std::size_t>(i) * (1 + nu);
    const std::span<const Slot> all(value);
    R.push_back(w.inlined(
        F, arguments(w.input(time), {all.first(n), slope, all.subspan(n), inputs_from(w, time + 1, nu), p})));
  }
  Table solved;  // in transformed variables; the right sides are -w and, for pairs, -(w₁ - i w₂)
  const auto right = [&](int row, double sign) {
    std::vector<double> factors = row_of(formula.T_inverse, row, s);
    for (double& f : factors) f *= sign;
    std::vector<Slot> list;
    for (std::size_t k = 0; k < N; ++k) list.push_back(mixed(factors, R, k));
    return list;
  };
  int row = 0;
  if (formula.has_real)
    solved.push_back(
        real->write_solution(w, inputs_from(w, at.real, real->factors().size()), right(row++, -1)));
  std::size_t from = at.complex;
  for (const auto* lu : complex) {
    const auto re = right(row, -1), im = right(row + 1, 1);
    row += 2;
    std::vector<Slot> b;
    for (std::size_t k = 0; k < N; ++k) b.push_back(re[k]), b.push_back(im[k]);
    const auto x = lu->write_solution(w, inputs_from(w, from, lu->factors().size()), b);
    from += lu->factors().size();
    solved.emplace_back(), solved.emplace_back();
    for (std::size_t k = 0; k < N; ++k)
      solved[solved.size() - 2].push_back(x[2 * k]), solved.back().push_back(w.put(Op::neg, x[2 * k + 1]));
  }
  std::vector<Slot> results;
  Slot sum = w.constant(0), largest = w.constant(0);
  for (int i = 0; i < s; ++i)
    for (std::size_t k = 0; k < N; ++k) {
      const Slot step = mixed(row_of(formula.T, i, s), solved, k);
      results.push_back(w.put(Op::add, stage[static_cast<std::size_t>(i)][k], step));
      const Slot scaled = w.put(Op::mul, step, w.input(at.r + k));
      const Slot square = w.put(Op::mul, scaled, scaled);
      sum = w.put(Op::add, sum, square), largest = w.put(Op::max, largest, square);
    }
  results.push_back(sum), results.push_back(largest);
  return w.finish(std::move(results));
}

std::shared_ptr<NewtonCode> NewtonCode::make(const Problem& problem, const IrkFormula& formula,
                                             const codegen::StraightLU* real, const Complex& complex,
                                             long iterations, bool now) {
  constexpr long enough = 100;
  if (!Machine::available()) return nullptr;
  Key key{1, static_cast<std::uint32_t>(formula.s)};
  add(key, problem.model().F), add(key, problem.arguments());
  for (double c : formula.c) add(key, c);
  std::vector<std::shared_ptr<const void>> pivots;
  if (real) pivots.push_back(real->pivots());
  for (const auto* lu : complex) pivots.push_back(lu->pivots());
  for (const auto& pivot : pivots)
    add(key, std::bit_cast<double>(reinterpret_cast<std::uint64_t>(pivot.get())));
  const std::lock_guard lock(store().mutex);
  const auto entry = store().entry(key);
  if (entry->wanted < 0) return nullptr;  // too long
  const Layout at(problem, formula.s, real, complex);
  if (!entry->machine) {
    entry->wanted += iterations;
    entry->kept = pivots;
    if (!now && entry->wanted < enough) return nullptr;
    Program code = program(problem, formula, at, real, complex);
    if (code.instructions.size() <= longest) entry->machine = Machine::compile(code);
    if (!entry->machine) entry->wanted = -1;
    if (!entry->machine) return nullptr;
  }
  std::shared_ptr<NewtonCode> code(new NewtonCode(at));
  code->machine_ = entry->machine;
  code->pivots_ = pivots;
  code->c_ = formula.c;
  code->in_.resize(at.end);
  code->out_.resize(at.end - at.Z + 2);
  code->work_.resize(code->machine_->workspace_size());
  return code;
}

bool NewtonCode::suits(const codegen::StraightLU* real, const Complex& complex) const {
  std::size_t k = 0;
  if (real && pivots_[k++].get() != real->pivots().get()) return false;
  return std::all_of(complex.begin(), complex.end(),
                     [&](const auto* lu) { return pivots_[k++].get() == lu->pivots().get(); });
}

void NewtonCode::set_factors(const codegen::StraightLU* real, const Complex& complex) {
  double* to = in_.data() + at_.real;
  if (real) to = std::copy(real->factors().begin(), real->factors().end(), to);
  for (const auto* lu : complex) to = std::copy(lu->factors().begin(), lu->factors().end(), to);
}

void NewtonCode::begin(Problem& problem, double t, double dt, const double* y, const double* scale) {
  const std::size_t N = at_.r - at_.y;
  in_[0] = 1 / dt;
  std::copy_n(y, N, in_.data() + at_.y);
  for (std::size_t k = 0; k < N; ++k) in_[at_.r + k] = 1 / scale[k];
  std::copy(problem.values().end() - static_cast<std::ptrdiff_t>(at_.stages - at_.p), problem.values().end(),
            in_.data() + at_.p);
  write_stages(problem, c_, 0, t, dt, in_.data() + at_.stages);
}

void NewtonCode::iterate(std::vector<double>& Z, double& sum, double& largest) {
  std::copy(Z.begin(), Z.end(), in_.begin() + static_cast<std::ptrdiff_t>(at_.Z));
  machine_->run(in_.data(), out_.data(), work_.data());
  sum = out_[Z.size()], largest = out_[Z.size() + 1];
  std::copy_n(out_.begin(), Z.size(), Z.begin());
}

}  // namespace pendula::integrate
