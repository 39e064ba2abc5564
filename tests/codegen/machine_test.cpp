// Machine code against the tape: the same bits, on every operation and on random graphs.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "codegen/kernel/kernel.hpp"
#include "codegen/machine/functions.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/machine/registers.hpp"
#include "codegen/tape/tape.hpp"
#include "expr/graph/solve.hpp"
#include "tests/expr/random_expressions.hpp"
#include "tests/require_code.hpp"

namespace pendula::machine_test {

using codegen::Kernel;

namespace {

bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

/// A kernel with machine code, and the tape it is compared with.
struct Pair {
  Kernel kernel;
  codegen::Tape tape;
  Pair(std::span<const Expr> outputs, std::span<const Expr> inputs)
      : kernel(outputs, inputs), tape(codegen::lower(outputs, inputs)) {}

  /// The number of outputs that differ at this point.
  int differences(const std::vector<double>& in) const {
    std::vector<double> work(tape.workspace_size() + kernel.workspace_size()), slow(kernel.outputs()),
        fast(kernel.outputs());
    tape.run(in.data(), slow.data(), work.data());
    kernel.run(in.data(), fast.data(), work.data());
    int count = 0;
    for (std::size_t i = 0; i < slow.size(); ++i) count += !same(slow[i], fast[i]);
    return count;
  }
};

const std::vector<double> awkward = {0.0,
                                     -0.0,
                                     1.0,
                                     -1.0,
                                     0.5,
                                     -2.5,
                                     1e-320,
                                     1e300,
                                     -1e300,
                                     static_cast<double>(NAN),
                                     static_cast<double>(INFINITY),
                                     static_cast<double>(-INFINITY)};

}  // namespace

TEST_CASE("machine code: every operation agrees with the tape bit for bit, on ordinary and awkward numbers") {
  REQUIRE_CODE(1);
  const Expr x[] = {symbol(Kind::variable, "mx"), symbol(Kind::variable, "my"), symbol(Kind::variable, "mz")};
  std::vector<Expr> outputs;
  for (Op op = first_op; op < end_op; op = next(op)) {
    outputs.push_back(
        make(op, x[0], info(op).arity > 1 ? x[1] : Expr(0), info(op).arity > 2 ? x[2] : Expr(0)));
    outputs.push_back(
        make(op, x[1], info(op).arity > 1 ? x[0] : Expr(0), info(op).arity > 2 ? x[2] : Expr(0)) + 1);
  }
  const Pair both(outputs, x);
  REQUIRE(both.kernel.accelerate());
  for (double a : awkward)
    for (double b : awkward)
      for (double c : {0.0, 2.0, static_cast<double>(NAN)}) CHECK(both.differences({a, b, c}) == 0);
}

TEST_CASE("machine code: sine and cosine of one argument, which one call computes, to the bit") {
  REQUIRE_CODE(1);
  const Expr x = symbol(Kind::variable, "mx"), y = symbol(Kind::variable, "my");
  const Expr inputs[] = {x, y};
  const Expr s = sin(x), c = cos(x);
  const std::vector<Expr> outputs{s * c, c + y, s, cos(y), sin(2 * y) - cos(2 * y), sin(s) * cos(s), sin(c)};
  const Pair both(outputs, inputs);
  REQUIRE(both.kernel.accelerate());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  int wrong = 0;
  for (int run = 0; run < 20000; ++run) {
    const double size = std::pow(10, 8 * u(random));
    wrong += both.differences({size * u(random), u(random)});
  }
  for (double a : awkward) wrong += both.differences({a, -a});
  CHECK(wrong == 0);
}

TEST_CASE("machine code: random graphs with many live values agree with the tape bit for bit") {
  REQUIRE_CODE(1);
  RandomExpressions random(20261121);
  for (int round = 0; round < 60; ++round) {
    std::vector<Expr> outputs;
    for (int k = 0; k < 1 + round * 3; ++k) outputs.push_back(random.expression(2 + random.pick(9)));
    // Sums of everything keep values alive across the whole program.
    Expr all = 0;
    for (Expr e : outputs) all = all + e * all + e;
    outputs.push_back(all);
    outputs.push_back(outputs[0]);
    const auto at = random.point();
    std::vector<Expr> inputs;
    std::vector<double> in;
    for (const auto& [leaf, value] : at) inputs.push_back(leaf), in.push_back(value);
    const Pair both(outputs, inputs);
    if (!both.kernel.accelerate()) continue;
    for (int point = 0; point < 5; ++point) {
      CHECK(both.differences(in) == 0);
      for (double& v : in) v = -1.3 * v + 0.1;
    }
  }
}

TEST_CASE("machine code: linear systems, with shared factors and components as outputs") {
  REQUIRE_CODE(1);
  RandomExpressions random(7);
  for (int n = 2; n <= 7; ++n) {
    MatX A(n, n);
    VecX b(n), c(n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) A(i, j) = random.expression(3) + (i == j ? Expr(7) : Expr(0));
      b[i] = random.expression(4);
      c[i] = random.expression(2);
    }
    const VecX x = linear_solution(A, b), y = linear_solution(A.transpose(), c);
    std::vector<Expr> outputs(x.begin(), x.end());
    for (Expr e : y) outputs.push_back(sin(e)), outputs.push_back(e);
    const auto at = random.point();
    std::vector<Expr> inputs;
    std::vector<double> in;
    for (const auto& [leaf, value] : at) inputs.push_back(leaf), in.push_back(value);
    const Pair both(outputs, inputs);
    REQUIRE(both.kernel.accelerate());
    CHECK(both.differences(in) == 0);
  }
}

TEST_CASE("machine code: a kernel that is run often switches by itself, copies share the code") {
  REQUIRE_CODE(1);
  const Expr x[] = {symbol(Kind::variable, "mhot")};
  Expr e = x[0];
  for (int i = 0; i < 2000; ++i) e = e * x[0] + 1;
  const Kernel kernel({&e, 1}, x), copy = kernel;
  double first = 0, out = 0;
  const double in = 0.5;
  std::vector<double> work(kernel.workspace_size());
  kernel.run(&in, &first, work.data());
  CHECK(!kernel.is_machine_code());
  for (int i = 0; i < 1000; ++i) kernel.run(&in, &out, work.data());
  CHECK(copy.is_machine_code());
  CHECK(same(first, out));
}

TEST_CASE("kernels: the same expressions are compiled once, other inputs are another kernel") {
  const Expr x = symbol(Kind::variable, "mx"), y = symbol(Kind::variable, "my");
  const Expr e = x * 3 + y;
  const Expr xy[] = {x, y}, yx[] = {y, x};
  const Kernel a({&e, 1}, xy), b({&e, 1}, xy), c({&e, 1}, yx);
  if (a.accelerate()) {
    CHECK(b.is_machine_code());
    CHECK(!c.is_machine_code());
  }
  CHECK(b(std::vector<double>{1, 2})[0] == 5);
  CHECK(c(std::vector<double>{1, 2})[0] == 7);
}

namespace {

/// The value column of ops.def, whatever the arity.
double value_of(const codegen::Instruction& i, double a, double b, double c) {
  using One = double (*)(double, double, double);
  return reinterpret_cast<One>(const_cast<void*>(codegen::scalar_function(i.op)))(a, b, c);
}

bool within_2_ulp(double a, double b) {
  if (same(a, b) || a == b) return true;
  return std::fabs(a - b) <= 2 * (std::nextafter(std::fabs(b), INFINITY) - std::fabs(b));
}

/// All values of a program as its results.
codegen::Program with_all_values(codegen::Program program) {
  program.results.clear();
  for (std::size_t k = 0; k < program.instructions.size(); ++k)
    program.results.push_back(program.first_instruction() + static_cast<codegen::Slot>(k));
  return program;
}

/// The results of the program on lanes; every lane has its point from `points` (point after point).
std::vector<double> run_on_lanes(const codegen::Program& program, int lanes,
                                 const std::vector<double>& points) {
  const std::size_t n = program.inputs, m = program.results.size();
  const auto machine = codegen::Machine::compile(program, lanes);
  const auto W = static_cast<std::size_t>(lanes);
  std::vector<double> in(n * W), out(m * W), work(machine->workspace_size()), result;
  for (std::size_t first = 0; first * n < points.size(); first += W) {
    for (std::size_t l = 0; l < W; ++l)
      for (std::size_t k = 0; k < n; ++k)  // behind the last point: the first again
        in[k * W + l] = points[(first + l) * n < points.size() ? (first + l) * n + k : k];
    machine->run(in.data(), out.data(), work.data());
    for (std::size_t l = 0; l < W && (first + l) * n < points.size(); ++l)
      for (std::size_t k = 0; k < m; ++k) result.push_back(out[k * W + l]);
  }
  return result;
}

std::vector<double> all_values(const codegen::Program& program, int lanes,
                               const std::vector<double>& points) {
  return run_on_lanes(with_all_values(program), lanes, points);
}

/// How many values of the program differ from what their operation makes of their operands: arithmetic and
/// conditions by a bit, functions by more than 2 ulp (or, with ulp = 0, a bit).
int wrong_values(const codegen::Program& p, const std::vector<double>& points,
                 const std::vector<double>& values, int ulp = 2) {
  const std::size_t n = p.inputs, m = p.instructions.size();
  int wrong = 0;
  for (std::size_t point = 0; point * n < points.size(); ++point) {
    const auto of = [&](codegen::Slot v) {
      return v < n                       ? points[point * n + v]
             : v < p.first_instruction() ? p.constants[v - n]
                                         : values[point * m + (v - p.first_instruction())];
    };
    for (std::size_t k = 0; k < m; ++k) {
      const codegen::Instruction& i = p.instructions[k];
      const int arity = i.operands();
      const double a = of(i.operand[0]), b = arity > 1 ? of(i.operand[1]) : 0,
                   c = arity > 2 ? of(i.operand[2]) : 0, v = values[point * m + k];
      const double expected = value_of(i, a, b, c);
      wrong +=
          !(ulp > 0 && codegen::is_call(i) ? within_2_ulp(v, expected) : same(v, expected) || v == expected);
    }
  }
  return wrong;
}

}  // namespace

TEST_CASE("machine code on lanes: every operation, ordinary and awkward numbers, to 2 ulp") {
  const Expr x[] = {symbol(Kind::variable, "mx"), symbol(Kind::variable, "my"), symbol(Kind::variable, "mz")};
  std::vector<double> points;
  for (double a : awkward)
    for (double b : awkward)
      for (double c : {0.0, 2.0, static_cast<double>(NAN)}) points.insert(points.end(), {a, b, c});
  for (int lanes : {4, 8}) {
    if (!codegen::Machine::available(lanes)) continue;
    for (Op op = first_op; op < end_op; op = next(op)) {
      const int arity = info(op).arity;
      const Expr e = make(op, x[0], arity > 1 ? x[1] : Expr(0), arity > 2 ? x[2] : Expr(0));
      const codegen::Program program = codegen::lower({&e, 1}, x);
      CHECK_MESSAGE(wrong_values(program, points, all_values(program, lanes, points)) == 0,
                    std::string(info(op).name), " on ", lanes, " lanes");
    }
  }
}

TEST_CASE("machine code on lanes: random graphs; neighbours and the number of lanes change no bit") {
  REQUIRE_CODE(4);
  RandomExpressions random(20261122);
  for (int round = 0; round < 40; ++round) {
    std::vector<Expr> outputs, inputs;
    for (int k = 0; k < 1 + round * 3; ++k) outputs.push_back(random.expression(2 + random.pick(9)));
    Expr all = 0;
    for (Expr e : outputs) all = all + e * all + e;  // alive across the whole program
    outputs.push_back(all);
    std::vector<double> points, backwards;
    for (const auto& [leaf, value] : random.point()) inputs.push_back(leaf), points.push_back(value);
    const std::size_t n = inputs.size();
    for (std::size_t k = 0; k < 10 * n; ++k) points.push_back(-1.3 * points[k] + 0.1 + 40.0 * (k % 7 == 0));
    for (std::size_t k = points.size(); k > 0; k -= n)
      backwards.insert(backwards.end(), points.begin() + static_cast<std::ptrdiff_t>(k - n),
                       points.begin() + static_cast<std::ptrdiff_t>(k));
    const codegen::Program program = codegen::lower(outputs, inputs);
    const auto four = all_values(program, 4, points);
    CHECK(wrong_values(program, points, four) == 0);
    const auto other = all_values(program, 4, backwards);
    const std::size_t m = program.instructions.size();
    int different = 0;
    for (std::size_t point = 0; point < 11; ++point)
      for (std::size_t k = 0; k < m; ++k)
        different += !same(four[point * m + k], other[(10 - point) * m + k]);
    CHECK(different == 0);
    if (!codegen::Machine::available(8)) continue;
    const auto eight = all_values(program, 8, points);
    for (std::size_t k = 0; k < four.size(); ++k) different += !same(four[k], eight[k]);
    CHECK(different == 0);
  }
}

/// Of a solution y in two unknowns x: calls check(input, outputs of the tape, outputs on lanes) at 80 points.
template <class Check>
static void on_lanes_and_alone(const VecX& y, std::span<const Expr> x, const Check& check) {
  constexpr std::size_t points = 80;
  const codegen::Program program = codegen::lower(std::vector<Expr>(y.begin(), y.end()), x);
  const codegen::Tape tape(program);
  const auto n = static_cast<std::size_t>(y.size());
  std::vector<double> in(2 * points), one(n), work(tape.workspace_size());
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = std::sin(static_cast<double>(i));
  for (int lanes : {4, 8}) {
    if (!codegen::Machine::available(lanes)) continue;
    const auto many = run_on_lanes(program, lanes, in);
    for (std::size_t p = 0; p < points; ++p) {
      tape.run(in.data() + 2 * p, one.data(), work.data());
      check(in.data() + 2 * p, one, many.data() + n * p);
    }
  }
}

TEST_CASE("machine code: linear systems on lanes") {
  REQUIRE_CODE(4);
  const Expr x[] = {symbol(Kind::variable, "mx"), symbol(Kind::variable, "my")};
  MatX A(3, 3);
  A << x[0] + 4, x[1], 1, x[1], x[0] + 5, x[0] * x[1], 1, x[0], 6;
  VecX b(3);
  b << x[0], 1, x[1];
  const auto equal = [](const double*, const std::vector<double>& one, const double* many) {
    for (std::size_t k = 0; k < one.size(); ++k) CHECK(same(one[k], many[k]));
  };
  on_lanes_and_alone(linear_solution(A, b), x, equal);
}

TEST_CASE("machine code on lanes: definite systems of few diagonals") {
  REQUIRE_CODE(4);
  const int n = 120;  // below 100, elimination is written out
  const Expr x[] = {symbol(Kind::variable, "mx"), symbol(Kind::variable, "my")};
  std::vector<Entry> A;
  VecX b(n);
  for (int i = 0; i < n; ++i) {
    A.push_back({i, i, x[0] + (5 + i)});
    for (int j : {i - 2, i - 1, i + 1, i + 2})
      if (j >= 0 && j < n) A.push_back({i, j, x[1] / (1 + std::min(i, j))});
    b[i] = x[0] * (i + 1);
  }
  std::sort(A.begin(), A.end(), [](const Entry& a, const Entry& c) {
    return std::pair(a.row, a.column) < std::pair(c.row, c.column);
  });
  const auto check = [&](const double* in, std::vector<double>& one, const double* many) {
    for (std::size_t k = 0; k < n; ++k) CHECK(same(one[k], many[k]));
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd r(n);
    for (const Entry& e : A) M(e.row, e.column) = evaluate({&e.value, 1}, {{x[0], in[0]}, {x[1], in[1]}})[0];
    for (int i = 0; i < n; ++i) r[i] = in[0] * (i + 1);
    // Definite: the residual of elimination is one of rounding (Higham 2002, Thm 10.4).
    CHECK((M * Eigen::Map<Eigen::VectorXd>(one.data(), n) - r).norm() <= 1e-13 * r.norm());
  };
  on_lanes_and_alone(linear_solution(A, b, true), x, check);
}

TEST_CASE("tape: on random graphs every value is what its operation makes of its operands, bit for bit") {
  RandomExpressions random(20261123);
  for (int round = 0; round < 40; ++round) {
    std::vector<Expr> outputs, inputs;
    for (int k = 0; k < 1 + round * 3; ++k) outputs.push_back(random.expression(2 + random.pick(9)));
    std::vector<double> points;
    for (const auto& [leaf, value] : random.point()) inputs.push_back(leaf), points.push_back(value);
    for (std::size_t k = 0; k < 4 * inputs.size(); ++k) points.push_back(-1.3 * points[k] + 0.1);
    const codegen::Program program = codegen::lower(outputs, inputs);
    const codegen::Tape tape(with_all_values(program));
    const std::size_t n = program.inputs, m = program.instructions.size();
    std::vector<double> values(5 * m), work(tape.workspace_size());
    for (std::size_t point = 0; point < 5; ++point)
      tape.run(points.data() + point * n, values.data() + point * m, work.data());
    CHECK(wrong_values(program, points, values, 0) == 0);
  }
}

}  // namespace pendula::machine_test
