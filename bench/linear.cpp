// Where dense, straight-line and KLU factorisations change places: integrate/solve/linear_solver.hpp takes
// its limits from this table. Call: bench_linear [real|complex]
//
// Per line: size, pattern and number of entries; µs for one factorisation and one solution by each method (a
// refactorisation for KLU, with new values each time); for straight-line code also its instructions, the µs
// that choosing pivots and making it costs, and after how many factorisations it has paid for itself.
//
//   band     tridiagonal             arrow    last row and column full, and the diagonal
//   blocks   a chain of 4 × 4 blocks, each coupled with its neighbours: multibody systems
//   circuit  about four entries per row at random places, symmetric, and rows without a diagonal
//   grid     five-point stencil on a square: the fill grows
//   third    a third of all entries, at random places             dense    all of them
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstring>
#include <random>
#include <set>
#include <string>

#include "base/text.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace {

using namespace pendula;
using namespace pendula::integrate;

std::vector<Position> pattern(const std::string& name, int n, std::mt19937& random) {
  std::set<std::pair<int, int>> entries;
  const auto both = [&](int i, int j) {
    if (j >= 0 && j < n) entries.insert({i, j}), entries.insert({j, i});
  };
  const int side = static_cast<int>(std::lround(std::sqrt(n)));
  for (int i = 0; i < n; ++i) {
    if (name == "band") both(i, i), both(i, i + 1);
    if (name == "arrow") both(i, i), both(i, n - 1);
    if (name == "blocks")
      for (int j = i / 4 * 4 - 4; j < i / 4 * 4 + 4; ++j) both(i, j);
    if (name == "circuit") {
      if (i % 5 != 4 || i == n - 1) both(i, i);
      both(i, (i + 1) % n), both(i, static_cast<int>(random() % static_cast<unsigned>(n)));
    }
    if (name == "grid") {
      both(i, i), both(i, i + side);
      if ((i + 1) % side != 0) both(i, i + 1);
    }
    if (name == "third") {
      both(i, i);
      for (int j = 0; j < i; ++j)
        if (random() % 3 == 0) both(i, j);
    }
    if (name == "dense")
      for (int j = 0; j < n; ++j) both(i, j);
  }
  std::vector<Position> list;
  for (const auto& [i, j] : entries) list.push_back({i, j});
  return list;
}

template <class Scalar>
std::vector<Scalar> values(const std::vector<Position>& positions, std::mt19937& random) {
  std::uniform_real_distribution<> u(-1, 1);
  std::vector<Scalar> list;
  for (const Position& p : positions) {
    double parts[2] = {u(random) + (p.row == p.column ? 3 : 0), u(random)};
    Scalar v;
    std::memcpy(&v, parts, sizeof v);
    list.push_back(v);
  }
  return list;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// µs for one factorisation and one solution: the best of some batches. NaN: this way does not exist.
template <class Scalar>
double cost(LinearSolver<Scalar>& solver, const std::vector<std::vector<Scalar>>& matrices, bool straight) {
  std::vector<Scalar> b(static_cast<std::size_t>(solver.size()));
  double best = 1e9;
  long batch = 1;
  for (int round = 0; round < 12; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    for (long k = 0; k < batch; ++k) {
      if (!solver.factorise(matrices[static_cast<std::size_t>(k) % matrices.size()].data())) return NAN;
      std::fill(b.begin(), b.end(), Scalar(1));
      solver.solve(b.data());
    }
    const double seconds = seconds_since(begin);
    if (straight != (solver.straight() != nullptr)) return NAN;
    best = std::min(best, seconds / static_cast<double>(batch));
    if (seconds < 2e-3) batch *= 4, --round;  // too short to be measured
  }
  return 1e6 * best;
}

template <class Scalar>
void line(Table& table, const std::string& name, int n) {
  using Factorisation = typename LinearSolver<Scalar>::Factorisation;
  std::mt19937 random(static_cast<unsigned>(n));
  const auto positions = pattern(name, n, random);
  std::vector<std::vector<Scalar>> matrices;
  for (int k = 0; k < 8; ++k) matrices.push_back(values<Scalar>(positions, random));
  for (auto& m : matrices)  // near the first: no other pivots are needed
    for (std::size_t k = 0; k < m.size(); ++k) m[k] = matrices[0][k] + 0.02 * m[k];
  double time[4] = {NAN, NAN, NAN, NAN};
  int k = 0;
  std::string plan = "-", instructions = "-", pays = "-";
  for (Factorisation way :
       {Factorisation::dense, Factorisation::straight, Factorisation::sparse, Factorisation::band}) {
    LinearSolver<Scalar> solver;
    solver.analyse(n, positions, way);
    const auto begin = std::chrono::steady_clock::now();
    const bool fine = solver.factorise(matrices[0].data());
    const double making = 1e6 * seconds_since(begin);
    time[k] = fine ? cost(solver, matrices, way == Factorisation::straight) : NAN;
    if (way == Factorisation::straight && solver.straight())
      plan = rounded(making, 3), instructions = std::to_string(solver.straight()->instructions());
    if (way == Factorisation::sparse) {
      const double other = std::min(time[0], time[2]);  // the band is compared by eye
      if (plan != "-" && time[1] < other) pays = rounded(std::ceil(std::stod(plan) / (other - time[1])), 3);
    }
    ++k;
  }
  const auto shown = [](double t) { return std::isnan(t) ? std::string("-") : rounded(t, 3); };
  const char* names[] = {"dense", "straight", "KLU", "band"};
  int best = -1;
  for (int i = 0; i < 4; ++i)
    if (!std::isnan(time[i]) && (best < 0 || time[i] < time[best])) best = i;
  table.row({name, std::to_string(n), std::to_string(positions.size()), shown(time[0]), shown(time[1]),
             shown(time[2]), shown(time[3]), best < 0 ? "-" : names[best], instructions, plan, pays});
}

template <class Scalar>
void print_table(const char* title) {
  std::printf("%s: µs for one factorisation and one solution\n", title);
  Table table({false, true, true, true, true, true, true, false, true, true, true});
  table.row({"pattern", "n", "entries", "dense", "straight", "KLU", "band", "best", "instructions", "making",
             "pays after"});
  for (const char* name : {"band", "arrow", "blocks", "circuit", "grid", "third", "dense"})
    for (int n : {4, 9, 16, 25, 36, 64, 100, 144, 196, 256, 400}) {
      line<Scalar>(table, name, n);
      std::fprintf(stderr, "\r%s %d        ", name, n);
    }
  std::fprintf(stderr, "\r                \r");
  std::printf("%s\n", table.str(0).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  const std::string which = argc > 1 ? argv[1] : "";
  if (which != "complex") print_table<double>("real");
  if (which != "real") print_table<std::complex<double>>("complex");
  return 0;
}
