// The tape's loops over repeated structure against plain evaluation, expression by expression.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "codegen/kernel.hpp"
#include "codegen/pieces.hpp"
#include "codegen/tape.hpp"
#include "expr/derivative.hpp"
#include "expr/solve.hpp"

using namespace pendula;

namespace {

constexpr int cells = 300;

std::vector<Expr> names(const char* stem) {
  std::vector<Expr> list;
  for (int i = 0; i < cells; ++i) list.push_back(symbol(Kind::variable, stem + std::to_string(i)));
  return list;
}

std::vector<double> values(std::size_t count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> draw(0.5, 1.5);
  std::vector<double> v(count);
  for (double& x : v) x = draw(random);
  return v;
}

struct Both {
  std::vector<double> tape, plain;
};
Both both(const std::vector<Expr>& outputs, const std::vector<Expr>& inputs, const std::vector<double>& in) {
  const codegen::Kernel kernel(outputs, inputs);
  std::vector<double> work(kernel.workspace_size()), out(outputs.size());
  kernel.run_tape(in.data(), out.data(), work.data());
  std::unordered_map<Expr, double> at;
  for (std::size_t i = 0; i < inputs.size(); ++i) at[inputs[i]] = in[i];
  return {out, evaluate(outputs, at)};
}

}  // namespace

TEST_CASE("tape: a chain of cells is loops, with the bits of plain evaluation") {
  const auto x = names("tx"), y = names("ty");
  const Expr k = symbol(Kind::parameter, "tk");
  std::vector<Expr> outputs, inputs = x;
  inputs.insert(inputs.end(), y.begin(), y.end());
  inputs.push_back(k);
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    const Expr d = x[i + 1] - x[i], e = y[i + 1] * y[i];
    outputs.push_back(k * d / (1 + e) - exp(-d) + sqrt(e));
    if (i > 0) outputs.push_back((x[i + 1] - x[i]) * (x[i] - x[i - 1]) - y[i] / k);
  }
  const Both r = both(outputs, inputs, values(inputs.size()));
  CHECK(r.tape == r.plain);
  const codegen::Tape tape(codegen::lower(outputs, inputs));
  CHECK(tape.regular_share() > 0.9);
  CHECK(tape.workspace_size() < inputs.size() + 2 * tape.operations() / 3);  // places are used again
}

TEST_CASE("tape: expressions without pattern") {
  const auto x = names("tx");
  std::mt19937_64 random(3);
  std::vector<Expr> pool = x;
  for (int i = 0; i < 3000; ++i) {
    const Expr a = pool[random() % pool.size()], b = pool[random() % pool.size()];
    const auto kind = random() % 4;
    pool.push_back(kind == 0 ? a + b : kind == 1 ? a - b : kind == 2 ? a * b / (1 + a * a) : -a);
  }
  const std::vector<Expr> outputs(pool.end() - 500, pool.end());
  const Both r = both(outputs, x, values(x.size()));
  REQUIRE(r.tape.size() == r.plain.size());
  for (std::size_t i = 0; i < r.tape.size(); ++i)
    CHECK(std::fabs(r.tape[i] - r.plain[i]) <= 1e-12 * (1 + std::fabs(r.plain[i])));
}

TEST_CASE("tape: a definite tridiagonal system of 300 unknowns by cyclic reduction") {
  const auto d = names("td"), e = names("te"), f = names("tf");
  std::vector<Entry> A;
  VecX b(cells);
  for (int i = 0; i < cells; ++i) {
    const auto k = static_cast<std::size_t>(i);
    A.push_back({i, i, 4 + d[k]});
    if (i > 0) A.push_back({i, i - 1, e[k]}), A.push_back({i - 1, i, e[k]});
    b[i] = f[k];
  }
  std::sort(A.begin(), A.end(), [](const Entry& p, const Entry& q) {
    return std::pair(p.row, p.column) < std::pair(q.row, q.column);
  });
  const VecX w = linear_solution(A, b, true);
  const std::vector<Expr> outputs(w.begin(), w.end());
  std::vector<Expr> inputs = d;
  inputs.insert(inputs.end(), e.begin(), e.end());
  inputs.insert(inputs.end(), f.begin(), f.end());
  const auto in = values(inputs.size());
  const codegen::Kernel kernel(outputs, inputs);
  const std::vector<double> x = kernel(in);
  CHECK(kernel.operations() < 25 * cells);
  double worst = 0;
  for (int i = 0; i < cells; ++i) {
    const auto k = static_cast<std::size_t>(i), n = static_cast<std::size_t>(cells);
    double r = (4 + in[k]) * x[k] - in[2 * n + k];
    if (i > 0) r += in[n + k] * x[k - 1];
    if (i + 1 < cells) r += in[n + k + 1] * x[k + 1];
    worst = std::max(worst, std::fabs(r));
  }
  CHECK(worst < 1e-14);  // ‖A‖ < 9, ‖x‖ < 1
}

TEST_CASE("arrange: stretches of stride 0, 1, 2 and 4, and every member once") {
  std::vector<codegen::Pair> members;
  for (std::uint32_t k = 0; k < 20; ++k) members.push_back({100 + k, 300 + k});
  for (std::uint32_t k = 0; k < 20; ++k) members.push_back({500 + 2 * k, 7});
  for (std::uint32_t k = 0; k < 20; ++k) members.push_back({700 + k, 800 + 4 * k});
  for (std::uint32_t k = 0; k < 5; ++k) members.push_back({900 + 31 * k, 3000 - 17 * k});
  std::shuffle(members.begin(), members.end(), std::mt19937_64(1));
  members.push_back(members.front());  // twice the same
  const codegen::Arrangement a = codegen::arrange(members);
  CHECK(a.stretches.size() == 3);
  std::vector<std::uint32_t> seen = a.order;
  std::sort(seen.begin(), seen.end());
  REQUIRE(seen.size() == members.size());
  for (std::uint32_t i = 0; i < seen.size(); ++i) CHECK(seen[i] == i);
  for (const auto& s : a.stretches)
    for (std::size_t k = 1; k < s.count; ++k) {
      const auto p = members[a.order[s.first + k - 1]], q = members[a.order[s.first + k]];
      CHECK(q.a - p.a == s.stride[0]);
      CHECK(q.b - p.b == s.stride[1]);
    }
}

TEST_CASE("tape: every operation has the bits of plain evaluation, on awkward numbers too") {
  const auto same = [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
           (std::isnan(a) && std::isnan(b));
  };
  const auto agree = [&](const Both& r) {
    return std::equal(r.tape.begin(), r.tape.end(), r.plain.begin(), same);
  };
  const std::vector<Expr> x = {symbol(Kind::variable, "tx"), symbol(Kind::variable, "ty"),
                               symbol(Kind::variable, "tz")};
  const double awkward[] = {0.0, -0.0, 1, -1, 0.5, -2.5, 1e-320, 1e300, -1e300, NAN, INFINITY, -INFINITY};
  for (Op op = first_op; op < end_op; op = next(op)) {
    CAPTURE(std::string(info(op).name));
    const int arity = info(op).arity;
    const Expr e = make(op, x[0], arity > 1 ? x[1] : Expr(0), arity > 2 ? x[2] : Expr(0));
    for (double a : awkward)
      for (double b : awkward) CHECK(agree(both({e}, x, {a, b, 2})));
  }
}
