// The road from equations to a structural analysis with verdict, on sparse models of
// n equations: linear in n.
//
//   ladder      diodes and capacitors (docs/benchmarks.md): index 1, n blocks of one equation
//   links       a planar chain of point masses: index 3, one block of n equations, J depends on the state
//   integrators x₁ prescribed, xₖ′ = xₖ₊₁ in groups of ten: index 10, offsets that count down
//   mass        M x′ = f with tridiagonal M: classified by the rank of ∂F/∂x′
#include <benchmark/benchmark.h>

#include "dae/model/make_model.hpp"
#include "dae/report/structure_report.hpp"

using namespace pendula;
using namespace pendula::dae;

namespace {

void add(std::vector<Block>& blocks, Expr lhs, Expr rhs) {
  blocks.push_back({VecX::Constant(1, lhs), VecX::Constant(1, rhs), ""});
}

std::vector<Block> ladder(int n) {
  const int N = n / 2;
  const auto w = symbol_vector(pendula::Kind::variable, "w", N),
             v = symbol_vector(pendula::Kind::variable, "v", N);
  const Expr R(10), C(1e-9), Is(1e-12), VT(0.02585), t = time_symbol();
  std::vector<Block> blocks;
  for (int k = 0; k < N; ++k) {
    const Expr left = k ? v[k - 1] : Expr(2) * sin(Expr(200000) * pi() * t);
    add(blocks, 0, (left - w[k]) / R + (v[k] - w[k]) / R - Is * (exp(w[k] / VT) - Expr(1)));
    add(blocks, C * derivative_leaf(v[k]), (w[k] - v[k]) / R + (k + 1 < N ? (w[k + 1] - v[k]) / R : Expr(0)));
  }
  return blocks;
}

std::vector<Block> links(int n) {
  const int N = n / 3;
  const auto x = symbol_vector(pendula::Kind::variable, "x", N),
             y = symbol_vector(pendula::Kind::variable, "y", N),
             z = symbol_vector(pendula::Kind::variable, "z", N);
  const Expr m(mpq_class(1, 1000)), g(9.81);
  std::vector<Block> blocks;
  const auto step = [&](const std::vector<Expr>& p, int k) { return k ? p[k] - p[k - 1] : p[k]; };
  for (int k = 0; k < N; ++k) {
    const bool last = k + 1 == N;
    add(blocks, m * derivative_leaf(x[k], 2),
        -z[k] * step(x, k) + (last ? Expr(0) : z[k + 1] * step(x, k + 1)));
    add(blocks, m * derivative_leaf(y[k], 2),
        -z[k] * step(y, k) + (last ? Expr(0) : z[k + 1] * step(y, k + 1)) - m * g);
    add(blocks, 0, step(x, k) * step(x, k) + step(y, k) * step(y, k) - Expr(1));
  }
  return blocks;
}

std::vector<Block> integrators(int n) {
  const auto x = symbol_vector(pendula::Kind::variable, "x", n);
  std::vector<Block> blocks;
  for (int k = 0; k < n; ++k)
    if (k % 10 == 9)
      add(blocks, x[k - 9], k > 9 ? sin(x[k - 19]) : sin(time_symbol()));
    else
      add(blocks, derivative_leaf(x[k]), x[k + 1]);
  return blocks;
}

std::vector<Block> mass(int n) {
  const auto x = symbol_vector(pendula::Kind::variable, "x", n);
  std::vector<Block> blocks;
  for (int k = 0; k < n; ++k) {
    Expr left = Expr(4) * derivative_leaf(x[k]);
    if (k > 0) left += derivative_leaf(x[k - 1]);
    if (k + 1 < n) left += derivative_leaf(x[k + 1]);
    add(blocks, left, -x[k] * x[k]);
  }
  return blocks;
}

void run(benchmark::State& state, std::vector<Block> (*make)(int)) {
  const int n = static_cast<int>(state.range(0)) / 30 * 30;
  const std::vector<Block> blocks = make(n);
  for (auto _ : state) {
    const StructureReport s = structure(make_model(blocks));
    if (s.verdict != Verdict::valid) state.SkipWithError("the structure is not valid");
    benchmark::DoNotOptimize(s.structural_index);
  }
  state.SetComplexityN(n);
}

}  // namespace

// One iteration: answers are remembered, and a second one would measure that.
#define PENDULA_SIZES \
  Iterations(1)->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->Complexity()
BENCHMARK_CAPTURE(run, ladder, ladder)->PENDULA_SIZES;
BENCHMARK_CAPTURE(run, links, links)->PENDULA_SIZES;
BENCHMARK_CAPTURE(run, integrators, integrators)->PENDULA_SIZES;
BENCHMARK_CAPTURE(run, mass, mass)->PENDULA_SIZES;
