// What expressions become before they are code.
#include <algorithm>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "codegen/kernel/kernel.hpp"
#include "codegen/program/program.hpp"

namespace pendula::program_test {

using namespace pendula::codegen;

namespace {

/// Attractions between n bodies on a line and across it, as one writes them: xⱼ - xᵢ in the equation of i.
std::vector<Expr> attractions(const std::vector<Expr>& x, const std::vector<Expr>& y) {
  std::vector<Expr> forces;
  for (std::size_t i = 0; i < x.size(); ++i) {
    Expr force = 0;
    for (std::size_t j = 0; j < x.size(); ++j) {
      if (j == i) continue;
      const Expr dx = x[j] - x[i], dy = y[j] - y[i];
      force += Expr(static_cast<long>(j + 1)) * dx / pow(dx * dx + pow(dy, 2), Expr(1.5));
    }
    forces.push_back(force);
  }
  return forces;
}

long count(const Program& program, Op op) {
  return std::count_if(program.instructions.begin(), program.instructions.end(),
                       [&](const Instruction& i) { return i.op == op; });
}

}  // namespace

TEST_CASE("program: distances are computed once for both bodies") {
  constexpr int n = 5, pairs = n * (n - 1) / 2;
  const auto x = symbol_vector(Kind::variable, "px", n), y = symbol_vector(Kind::variable, "py", n);
  std::vector<Expr> inputs = x;
  inputs.insert(inputs.end(), y.begin(), y.end());
  const std::vector<Expr> forces = attractions(x, y);
  CHECK(count(lower(forces, inputs), Op::sqrt) == pairs);

  std::vector<double> at, out(n);
  for (int k = 0; k < 2 * n; ++k) at.push_back(std::sin(3.0 * k + 1));
  Kernel(forces, inputs)(at.data(), out.data());
  for (std::size_t i = 0; i < n; ++i) {  // one at a time there is nothing to share
    double alone = 0;
    Kernel({&forces[i], 1}, inputs)(at.data(), &alone);
    CHECK(out[i] == alone);
  }
}

TEST_CASE("program: even functions of mirrored differences, and only those, are shared") {
  const Expr a = symbol(Kind::variable, "pa"), b = symbol(Kind::variable, "pb");
  const std::vector<Expr> inputs{a, b};
  const std::vector<Expr> f{pow(a - b, Expr(2)), (b - a) * (b - a),   pow(b - a, Expr(-4)), abs(a - b),
                            abs(b - a),          pow(b - a, Expr(3)), sin(a - b),           cos(b - a)};
  const Program program = lower(f, inputs);
  CHECK(program.results[0] == program.results[1]);
  CHECK(program.results[3] == program.results[4]);
  const std::vector<double> at{0.3, 1.7};
  std::vector<double> out(f.size());
  Kernel(f, inputs)(at.data(), out.data());
  const double u = at[0] - at[1];
  const std::vector<double> expected{u * u, u * u,      1 / (u * u * u * u), -u,
                                     -u,    -u * u * u, std::sin(u),         std::cos(u)};
  for (std::size_t k = 0; k < f.size(); ++k) CHECK(std::fabs(out[k] / expected[k] - 1) < 4e-16);
}

}  // namespace pendula::program_test
