#include "integrate/explicit_code.hpp"

#include <algorithm>

#include "integrate/step_programs.hpp"

namespace pendula::integrate {

using codegen::Key;
using codegen::Machine;
using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

/// In: h | x | K₁ | p | (t, u) of stages 2 … s.
Program explicit_program(const Problem& problem, const Tableau& rk) {
  const auto n = static_cast<std::size_t>(problem.n()), nu = input_count(problem),
             np = parameter_count(problem);
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
  if (problem.operations() * static_cast<std::size_t>(rk.stages() - 1) > 4 * longest_step_program)
    return nullptr;
  Key key{0, static_cast<std::uint32_t>(rk.stages())};
  add(key, problem.model().f), add(key, problem.arguments());
  for (int i = 0; i < rk.stages(); ++i) {
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    for (const auto& row :
         {std::optional<Vec>(rk.b()), std::optional<Vec>(rk.bhat()), std::optional<Vec>(rk.bhat2())})
      add(key, row ? (*row)[i] : 0);
  }
  const std::lock_guard lock(step_store().mutex);
  const auto entry = step_store().entry(key);
  if (entry->wanted++ == 0) {
    if (Program program = explicit_program(problem, rk); program.instructions.size() <= longest_step_program)
      entry->machines.push_back(Machine::compile(program, 1, codegen::Rounding::fused));
  }
  if (entry->machines.empty()) return nullptr;
  auto code = std::make_shared<ExplicitCode>();
  code->machine_ = entry->machines[0];
  code->c_.assign(rk.c().begin(), rk.c().end());
  code->work_.resize(code->machine_->workspace_size());
  code->in_.resize(1 + 2 * static_cast<std::size_t>(problem.n()) + parameter_count(problem) +
                   static_cast<std::size_t>(rk.stages() - 1) * (1 + input_count(problem)));
  return code;
}

void ExplicitCode::run(Problem& problem, const Point& from, double dt, double* out) {
  double* to = in_.data();
  *to++ = dt;
  to = std::copy_n(from.x.data(), problem.n(), to);
  to = std::copy_n(from.xdot.data(), problem.n(), to);
  to = write_parameters(problem, to);
  write_stages(problem, std::span(c_).subspan(1), from.t, dt, to);
  machine_->run(in_.data(), out, work_.data());
}

}  // namespace pendula::integrate
