// Identification: ARX with a million samples against numpy's lstsq on the same regression, the set of uniform
// noise, and the prediction-error models. example: bench_arx --benchmark_filter=arx
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "sysid/fit/order_scan.hpp"
#include "sysid/fit/pem.hpp"
#include "sysid/fit/subspace.hpp"
#include "sysid/model/state_space.hpp"
#include "sysid/model/validation.hpp"
#include "sysid/noise/likelihood.hpp"
#include "sysid/regression/structured.hpp"

using namespace pendula;
using namespace pendula::sysid;

namespace {

/// A y = B u + C e or y = B/F u + e, two poles at 0.75 ± 0.37i.
IdData record(Index n, unsigned seed, bool output_error) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  IdData d;
  d.u = Mat(n, 1), d.y = Mat(n, 1);
  double y1 = 0, y2 = 0, e1 = 0;
  for (Index t = 0; t < n; ++t) {
    d.u(t, 0) = normal(generator);
    const double e = 0.3 * normal(generator);
    double y = 1.5 * y1 - 0.7 * y2 + (t > 0 ? d.u(t - 1, 0) : 0) + (t > 1 ? 0.5 * d.u(t - 2, 0) : 0);
    if (!output_error) y += e + 0.5 * e1;
    d.y(t, 0) = output_error ? y + e : y;
    y2 = y1, y1 = y, e1 = e;
  }
  return checked(std::move(d));
}

Orders orders(int na, int nb, int nc, int nf) {
  Orders o;
  o.na = na, o.nb = {nb}, o.nk = {1}, o.nc = nc, o.nf = {nf};
  return o;
}

const IdData& million() {
  static const IdData d = record(1000000, 1, false);
  return d;
}

void arx_million(benchmark::State& state) {
  const IdData& d = million();
  for (auto _ : state) {
    const Regressor regressor(d, 0, orders(10, 10, 0, 0), InitialCondition::drop);
    benchmark::DoNotOptimize(solve_regression(regressor).theta.data());
  }
}
BENCHMARK(arx_million)->Unit(benchmark::kMillisecond);

void arx_million_blocked_qr(benchmark::State& state) {
  const IdData& d = million();
  for (auto _ : state) {
    const Regressor regressor(d, 0, orders(10, 10, 0, 0), InitialCondition::drop);
    benchmark::DoNotOptimize(solve_blocked(regressor).theta.data());
  }
}
BENCHMARK(arx_million_blocked_qr)->Unit(benchmark::kMillisecond);

/// numpy in its own process on the same numbers; `difference`: the largest of the 20 parameters against ours.
void arx_million_numpy(benchmark::State& state) {
  const IdData& d = million();
  char name[] = "/tmp/pendula_bench_XXXXXX";
  const int file = mkstemp(name);
  {
    std::ofstream out(name, std::ios::binary);
    const auto bytes = static_cast<std::streamsize>(sizeof(double) * static_cast<std::size_t>(d.samples()));
    out.write(reinterpret_cast<const char*>(d.y.data()), bytes);
    out.write(reinterpret_cast<const char*>(d.u.data()), bytes);
  }
  const std::string script =
      "import numpy as np, time, sys, os; os.environ['OPENBLAS_NUM_THREADS']='1'; "
      "v=np.fromfile(sys.argv[1]); N=len(v)//2; "
      "y=v[:N]; u=v[N:]; n=10; P=np.column_stack([-y[n-k:N-k] for k in range(1,n+1)]+[u[n-k:N-k] for k in "
      "range(1,n+1)]); "
      "r=y[n:].copy(); t=time.perf_counter(); th=np.linalg.lstsq(P,r,rcond=None)[0]; "
      "print(repr(time.perf_counter()-t)); [print(repr(float(x))) for x in th]";
  const Vec ours = solve_regression(Regressor(d, 0, orders(10, 10, 0, 0), InitialCondition::drop)).theta;
  double difference = 0;
  for (auto _ : state) {
    FILE* pipe = popen(
        ("OPENBLAS_NUM_THREADS=1 /usr/bin/python3 -c \"" + script + "\" " + name + " 2>/dev/null").c_str(),
        "r");
    double seconds = 0;
    if (!pipe || std::fscanf(pipe, "%lf", &seconds) != 1) {
      if (pipe) pclose(pipe);
      state.SkipWithError("no numpy: apt-get install python3-numpy");
      break;
    }
    for (const double value : ours) {
      double theirs = 0;
      if (std::fscanf(pipe, "%lf", &theirs) == 1) difference = std::max(difference, std::abs(theirs - value));
    }
    pclose(pipe);
    state.SetIterationTime(seconds);
  }
  state.counters["difference"] = difference;
  close(file);
  unlink(name);
}
BENCHMARK(arx_million_numpy)->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(3);

void uniform_set(benchmark::State& state) {
  const auto d = static_cast<Index>(state.range(0));
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> flat(-1, 1);
  Regression r;
  r.Phi = Mat(10000, d).unaryExpr([&](double) { return flat(generator); });
  r.y = r.Phi * Vec::LinSpaced(d, 1, static_cast<double>(d)) +
        Vec(10000).unaryExpr([&](double) { return flat(generator); });
  for (Index i = 0; i < d; ++i) r.names.push_back("p" + std::to_string(i));
  for (Index i = 1; i <= 10000; ++i) r.sample.push_back(i);
  Index vertices = 0;
  for (auto _ : state) vertices = parameter_set(r, -1, 1).polytope.vertices.rows();
  state.counters["vertices"] = static_cast<double>(vertices);
}
BENCHMARK(uniform_set)->DenseRange(2, 6)->Unit(benchmark::kMillisecond);

void output_error(benchmark::State& state) {
  const IdData d = record(10000, 2, true);
  for (auto _ : state) benchmark::DoNotOptimize(pem(d, 0, orders(0, 2, 0, 2), "OE", {}).theta.data());
}
BENCHMARK(output_error)->Unit(benchmark::kMillisecond);

void armax(benchmark::State& state) {
  const IdData d = record(10000, 2, false);
  for (auto _ : state) benchmark::DoNotOptimize(pem(d, 0, orders(2, 2, 1, 0), "ARMAX", {}).theta.data());
}
BENCHMARK(armax)->Unit(benchmark::kMillisecond);

/// State space of order 4, 15 block rows.
void n4sid(benchmark::State& state) {
  const IdData d = record(10000, 2, false);
  SubspaceOptions options;
  options.order = 4;
  for (auto _ : state) benchmark::DoNotOptimize(subspace(d, options).outputs.data());
}
BENCHMARK(n4sid)->Unit(benchmark::kMillisecond);

/// 500 models from one factorisation.
void order_scan_500(benchmark::State& state) {
  const IdData d = record(10000, 2, false);
  for (auto _ : state)
    benchmark::DoNotOptimize(order_scan(d, nullptr, {1, 10}, {1, 10}, {1, 5}, "bic").entries.data());
}
BENCHMARK(order_scan_500)->Unit(benchmark::kMillisecond);

}  // namespace
