// The tape's loops over repeated structure against plain evaluation, expression by expression.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>

#include "codegen/kernel/kernel.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/tape/tape.hpp"
#include "codegen/tape/vector_loops.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::tape_test {

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
  const codegen::Tape tape(codegen::lower(outputs, inputs));
  std::vector<double> work(tape.workspace_size()), out(outputs.size());
  tape.run(in.data(), out.data(), work.data());
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
  CHECK(tape.workspace_size() < inputs.size() + 4 * tape.operations() / 5);  // places are used again
}

namespace {

/// The instructions one after the other, in the order of the program.
std::vector<double> one_by_one(const codegen::Program& p, const std::vector<double>& in) {
  std::vector<double> value = in;
  value.insert(value.end(), p.constants.begin(), p.constants.end());
  for (const codegen::Instruction& i : p.instructions) {
    const double a = value[i.operand[0]], b = value[i.operand[1]];
    value.push_back(i.op == Op::add   ? a + b
                    : i.op == Op::sub ? a - b
                    : i.op == Op::mul ? a * b
                    : i.op == Op::div ? a / b
                    : i.op == Op::neg ? -a
                                      : std::sqrt(a));
  }
  std::vector<double> out;
  for (codegen::Slot slot : p.results) out.push_back(value[slot]);
  return out;
}

}  // namespace

TEST_CASE("tape: fused loops over neighbours of neighbours have the bits of the single operations") {
  // Families of expressions, each made of members of earlier ones near the same place: some can run in one
  // loop with a shift, some not (every other member, far members), some read single numbers.
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 random(seed);
    const std::size_t n = 400 + 37 * (seed % 5);
    const auto any = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
    std::vector<Expr> inputs;
    for (std::size_t i = 0; i < 2 * n; ++i)
      inputs.push_back(symbol(Kind::parameter, "tw" + std::to_string(i)));
    std::vector<std::vector<Expr>> families = {{inputs.begin(), inputs.begin() + static_cast<long>(n)},
                                               {inputs.begin() + static_cast<long>(n), inputs.end()}};
    std::vector<Expr> outputs;
    for (int level = 0; level < 14; ++level) {
      const auto a = families[any(families.size())], b = families[any(families.size())];
      const std::size_t kind = any(6), da = any(3), db = any(3), far = any(8) == 0 ? a.size() / 3 : 0;
      const std::size_t stride = any(7) == 0 ? 2 : 1;
      std::vector<Expr> family;
      for (std::size_t i = 0; stride * i + da + far < a.size() && i + db < b.size(); ++i) {
        const Expr x = a[stride * i + da + far], y = b[i + db];
        family.push_back(kind == 0   ? x + y
                         : kind == 1 ? x - y
                         : kind == 2 ? x * y
                         : kind == 3 ? x / (3 + y * y)
                         : kind == 4 ? -(x * b[0])
                                     : sqrt(1 + x * x) - y);
      }
      if (family.size() < 30) continue;
      if (any(3) == 0) outputs.insert(outputs.end(), family.begin(), family.end());
      outputs.push_back(family[any(family.size())]);
      families.push_back(std::move(family));
    }
    outputs.insert(outputs.end(), families.back().begin(), families.back().end());
    const codegen::Program program = codegen::lower(outputs, inputs);
    const codegen::Tape tape(program);
    const auto in = values(inputs.size());
    std::vector<double> work(tape.workspace_size()), out(outputs.size());
    tape.run(in.data(), out.data(), work.data());
    const std::vector<double> expected = one_by_one(program, in);
    CAPTURE(seed);
    CHECK(tape.regular_share() > 0.4);
    std::size_t different = 0;
    for (std::size_t i = 0; i < out.size(); ++i)
      different += std::bit_cast<std::uint64_t>(out[i]) != std::bit_cast<std::uint64_t>(expected[i]);
    CHECK(different == 0);
  }
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

namespace {

/// A definite matrix 4 + dₖ on the diagonal, eₖ between neighbours `far` apart, its unknowns renamed; solved
/// by the kernel on the tape and as machine code. The largest residual with b = f.
struct Solved {
  double residual;
  std::size_t operations;
  bool same_bits;
};
Solved solved(const std::vector<std::size_t>& name, const std::vector<std::size_t>& distances) {
  const auto d = names("td"), e = names("te"), f = names("tf");
  const std::size_t n = name.size();
  std::vector<Entry> A;
  VecX b(static_cast<int>(n));
  for (std::size_t k = 0; k < n; ++k) {
    const int i = static_cast<int>(name[k]);
    A.push_back({i, i, 4 + d[k]});
    b[i] = f[k];
    for (std::size_t far : distances)
      if (k >= far) {
        const int j = static_cast<int>(name[k - far]);
        A.push_back({i, j, e[k]});
        A.push_back({j, i, e[k]});
      }
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
  const codegen::Tape tape(codegen::lower(outputs, inputs));
  std::vector<double> x(n), work(tape.workspace_size());
  tape.run(in.data(), x.data(), work.data());
  Solved result{0, tape.operations(), true};
  if (const auto machine = codegen::Machine::compile(codegen::lower(outputs, inputs))) {
    std::vector<double> y(n), space(machine->workspace_size());
    machine->run(in.data(), y.data(), space.data());
    result.same_bits = x == y;
  }
  const auto cell = static_cast<std::size_t>(cells);
  std::vector<double> r(n);
  for (std::size_t k = 0; k < n; ++k) {
    r[k] += (4 + in[k]) * x[name[k]] - in[2 * cell + k];
    for (std::size_t far : distances)
      if (k >= far) {
        r[k] += in[cell + k] * x[name[k - far]];
        r[k - far] += in[cell + k] * x[name[k]];
      }
  }
  for (double v : r) result.residual = std::max(result.residual, std::fabs(v));
  return result;
}

std::vector<std::size_t> mixed(std::size_t n, std::uint64_t seed) {
  std::vector<std::size_t> name(n);
  std::iota(name.begin(), name.end(), std::size_t{0});
  if (seed > 0) std::shuffle(name.begin(), name.end(), std::mt19937_64(seed));
  return name;
}

}  // namespace

TEST_CASE("tape: definite systems of 300 unknowns with few diagonals, in any order of the unknowns") {
  // ‖A‖ < 9, ‖x‖ < 1
  for (std::uint64_t seed : {0, 5}) {
    CAPTURE(seed);
    const Solved chain = solved(mixed(cells, seed), {1}), ladder = solved(mixed(cells, seed), {1, 2});
    CHECK(chain.residual < 1e-14);
    CHECK(ladder.residual < 2e-14);
    CHECK(chain.operations <= 3 * cells);  // the system itself is one step
    CHECK(chain.same_bits);
    CHECK(ladder.same_bits);
  }
}

TEST_CASE("tape: definite systems whose diagonals are many are eliminated operation by operation") {
  const Solved wide = solved(mixed(cells, 0), {1, 100});
  CHECK(wide.residual < 2e-14);
  CHECK(wide.operations > 10 * cells);
  CHECK(wide.same_bits);
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

}  // namespace pendula::tape_test
