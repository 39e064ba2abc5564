// Systems [M Cᵀ; C D] without pivots: the answer of pivoted LU, and LU itself wherever that is not sound.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "codegen/kernel/kernel.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/program/checked.hpp"
#include "codegen/tape/tape.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::saddle_test {

namespace {

/// Symbols for the entries on and above the diagonal, b, and numbers for them with the solution x.
struct Saddle {
  int n = 0, leading = 0;
  std::vector<Entry> A;
  VecX b;
  std::vector<Expr> leaves;
  std::vector<double> numbers;  ///< of the leaves
  std::vector<double> x;

  void set(int i, int j, double value) { matrix.at({std::min(i, j), std::max(i, j)}) = value; }
  /// Numbers of A, b = A x in twice the precision.
  void place() {
    numbers.clear();
    for (const auto& [where, value] : matrix) numbers.push_back(value);
    for (int i = 0; i < n; ++i) {
      long double sum = 0;
      for (const auto& [where, value] : matrix) {
        if (where.first == i) sum += static_cast<long double>(value) * x[where.second];
        if (where.second == i && where.first != i) sum += static_cast<long double>(value) * x[where.first];
      }
      numbers.push_back(static_cast<double>(sum));
    }
  }
  std::map<std::pair<int, int>, double> matrix;
};

/// `bodies` blocks of two in M, every constraint on two of them; D: an entry on the diagonal of every third.
Saddle linkage(int bodies, int constraints, std::uint64_t seed, bool corner = false) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  Saddle s;
  s.leading = 2 * bodies;
  s.n = s.leading + constraints;
  for (int k = 0; k < bodies; ++k) {
    const double a = 1.5 + number(random), d = 1.5 + number(random);
    s.matrix[{2 * k, 2 * k}] = a;
    s.matrix[{2 * k + 1, 2 * k + 1}] = d;
    s.matrix[{2 * k, 2 * k + 1}] = 0.7 * number(random) * std::sqrt(a * d);
  }
  for (int i = 0; i < constraints; ++i) {
    for (int body : {i % bodies, (i + 1) % bodies})
      for (int part : {0, 1}) s.matrix[{2 * body + part, s.leading + i}] = number(random);
    if (corner && i % 3 == 0) s.matrix[{s.leading + i, s.leading + i}] = -0.5 - 0.5 * number(random);
  }
  static int made = 0;
  const std::string name = "saddle" + std::to_string(made++) + "_";
  for (const auto& [where, value] : s.matrix) {
    const Expr leaf = symbol(Kind::variable, name + std::to_string(s.leaves.size()));
    s.leaves.push_back(leaf);
    s.A.push_back({where.first, where.second, leaf});
    if (where.first != where.second) s.A.push_back({where.second, where.first, leaf});
  }
  s.b = VecX(s.n);
  for (int i = 0; i < s.n; ++i) {
    s.b[i] = symbol(Kind::variable, name + "b" + std::to_string(i));
    s.leaves.push_back(s.b[i]);
    s.x.push_back(number(random));
  }
  s.place();
  return s;
}

struct Answers {
  codegen::Kernel checked, pivoted;
  codegen::Program program;
};

Answers answers(const Saddle& s) {
  const VecX w = saddle_solution(s.A, s.b, s.leading), u = linear_solution(s.A, s.b * Expr(2));
  const std::vector<Expr> ours(w.begin(), w.end());
  std::vector<Expr> theirs;
  for (Expr e : u) theirs.push_back(e / 2);
  return {codegen::Kernel(ours, s.leaves), codegen::Kernel(theirs, s.leaves),
          codegen::lower_checked(ours, s.leaves)};
}

bool is_sound(const codegen::Program& program, const std::vector<double>& in) {
  const codegen::Tape tape(program);
  std::vector<double> out(program.results.size()), work(tape.workspace_size());
  tape.run(in.data(), out.data(), work.data());
  return out.back() == 1;
}

double error(const Saddle& s, const std::vector<double>& found) {
  double worst = 0;
  for (int i = 0; i < s.n; ++i) worst = std::max(worst, std::fabs(found[i] - s.x[i]));
  return std::isfinite(worst) ? worst : INFINITY;
}

bool has_nan(const std::vector<double>& list) {
  return std::any_of(list.begin(), list.end(), [](double v) { return std::isnan(v); });
}

}  // namespace

TEST_CASE("saddle points: the solution that is known, in fewer operations than LU") {
  for (int bodies = 2; bodies <= 12; ++bodies)
    for (const bool corner : {false, true}) {
      CAPTURE(bodies);
      CAPTURE(corner);
      const Saddle s =
          linkage(bodies, bodies - (corner ? 0 : 1), 7 * static_cast<std::uint64_t>(bodies), corner);
      const Answers a = answers(s);
      REQUIRE(a.program.results.size() == static_cast<std::size_t>(s.n) + 1);
      CHECK(is_sound(a.program, s.numbers));
      const double ours = error(s, a.checked(s.numbers)), theirs = error(s, a.pivoted(s.numbers));
      CHECK(ours < 1e-11);
      CHECK(ours < 100 * theirs + 1e-14);
      if (bodies > 6) CHECK(static_cast<double>(a.program.instructions.size()) < std::pow(s.n, 3) / 3);
    }
}

TEST_CASE("saddle points: where M is singular, indefinite or nearly so, the answer is that of pivots") {
  Saddle s = linkage(4, 3, 5);
  const Answers a = answers(s);
  const auto check = [&](bool sound) {
    s.place();
    CHECK(is_sound(a.program, s.numbers) == sound);
    const std::vector<double> ours = a.checked(s.numbers), theirs = a.pivoted(s.numbers);
    CHECK(!has_nan(ours));
    CHECK(error(s, ours) < 1e-11);
    if (!sound)
      for (int i = 0; i < s.n; ++i) CHECK(ours[i] == theirs[i]);
  };
  check(true);
  s.set(0, 1, 0);
  s.set(0, 0, 0);  // a coordinate without mass
  check(false);
  s.set(0, 0, -1);
  check(false);
  s.set(0, 0, 1);
  s.set(1, 1, 1);
  s.set(0, 1, 1);  // a block of rank one
  check(false);
  s.set(0, 1, 1 - 1e-7);
  check(false);
  s.set(0, 1, 2);  // indefinite
  check(false);
  s.set(0, 1, 0.5);
  check(true);
}

TEST_CASE("saddle points: what compares solutions sees those of pivots, too") {
  Saddle s = linkage(3, 2, 11);
  const VecX w = saddle_solution(s.A, s.b, s.leading);
  std::vector<Expr> outputs;
  for (Expr e : w) outputs.push_back(ifelse(lt(e, Expr(0)), Expr(-1), Expr(1)));
  const codegen::Kernel kernel(outputs, s.leaves);
  s.set(0, 1, 0);
  s.set(0, 0, 0);
  s.place();
  const std::vector<double> signs = kernel(s.numbers);
  for (int i = 0; i < s.n; ++i) CHECK(signs[i] == (s.x[i] < 0 ? -1 : 1));
}

TEST_CASE("saddle points: constraints that nearly depend on each other keep their pivots") {
  Saddle s = linkage(2, 2, 3);  // both constraints on both bodies
  for (int j = 0; j < s.leading; ++j) s.set(j, s.leading + 1, s.matrix[{j, s.leading}] * (1 + 1e-5 * j));
  s.place();
  const Answers a = answers(s);
  CHECK(!is_sound(a.program, s.numbers));
  CHECK(a.checked(s.numbers) == a.pivoted(s.numbers));
}

TEST_CASE("saddle points: neither units nor light bodies between heavy ones cost digits") {
  for (const double scale : {1e-8, 1e-3, 1e3, 1e8}) {
    CAPTURE(scale);
    Saddle s = linkage(4, 3, 21);
    for (auto& [where, value] : s.matrix) {  // other units of a coordinate, of a constraint
      value *= (where.first == 2 ? scale : 1) * (where.second == 2 ? scale : 1);
      if (where.second == s.leading + 1) value /= scale;
    }
    s.x[2] /= scale;
    s.x[s.leading + 1] *= scale;
    s.place();
    const Answers a = answers(s);
    CHECK(is_sound(a.program, s.numbers));
    const std::vector<double> found = a.checked(s.numbers);
    for (int i = 0; i < s.n; ++i) CHECK(found[i] == doctest::Approx(s.x[i]).epsilon(1e-11));
  }
  for (const double mass :
       {1e-4, 1e-8, 1e-12}) {  // of body 0, at the end of a chain: it goes where body 1 goes
    CAPTURE(mass);
    Saddle s = linkage(3, 2, 8);
    for (int i : {0, 1}) {
      s.set(i, i, mass * (1 + i));
      s.set(0, 1, 0.2 * mass);
    }
    s.set(0, s.leading, 1);
    s.place();
    const Answers a = answers(s);
    const std::vector<double> found = a.checked(s.numbers), other = a.pivoted(s.numbers);
    double along = 0, wanted = 0;  // C v of the constraint of both
    for (int j = 0; j < s.leading; ++j)
      if (const auto c = s.matrix.find({j, s.leading}); c != s.matrix.end()) {
        along += c->second * found[j];
        wanted += c->second * s.x[j];
      }
    CHECK(std::fabs(along - wanted) < 1e-12);
    for (int i = 2; i < s.n; ++i) CHECK(std::fabs(found[i] - s.x[i]) < 10 * error(s, other) + 1e-12);
  }
}

TEST_CASE("saddle points: tape and machine code give the same bits, sound or not") {
  Saddle s = linkage(5, 4, 2);
  const Answers a = answers(s);
  const auto machine = codegen::Machine::compile(a.program);
  if (!machine) return;
  for (const double mass : {1.0, 0.0}) {
    s.set(0, 1, 0);
    s.set(0, 0, mass);
    s.place();
    const std::vector<double> first = a.checked(s.numbers);
    std::vector<double> out(a.program.results.size()), work(machine->workspace_size());
    machine->run(s.numbers.data(), out.data(), work.data());
    CHECK(out.back() == mass);
    if (mass == 1)
      for (int i = 0; i < s.n; ++i) CHECK(out[i] == first[i]);
    for (int k = 0; k < 3000; ++k) a.checked(s.numbers);
    CHECK(a.checked(s.numbers) == first);
  }
}

TEST_CASE("saddle points: slopes of the solution share the factors, and are those of LU") {
  const Saddle s = linkage(3, 2, 13);
  const VecX w = saddle_solution(s.A, s.b, s.leading), u = linear_solution(s.A, s.b * Expr(3));
  std::vector<Expr> ours, theirs;
  for (Expr leaf : s.leaves) {
    ours.push_back(partial(w[1], leaf));
    theirs.push_back(partial(u[1], leaf) / 3);
  }
  const std::vector<double> p = codegen::Kernel(ours, s.leaves)(s.numbers),
                            q = codegen::Kernel(theirs, s.leaves)(s.numbers);
  for (std::size_t k = 0; k < p.size(); ++k) CHECK(p[k] == doctest::Approx(q[k]).epsilon(1e-11));
}

}  // namespace pendula::saddle_test
