// Sines of several angles in one call: the bits of the tape, right to an ulp, and a quarter of the calls.
#include "codegen/machine/wide_sines.hpp"

#include <bit>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "codegen/machine/machine.hpp"
#include "codegen/program/writer.hpp"
#include "codegen/routines/sines.hpp"
#include "codegen/tape/tape.hpp"
#include "tests/require_code.hpp"

namespace pendula::wide_sines_test {

using namespace pendula::codegen;

namespace {

/// An angle, small or large.
double draw(std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  return u(random) * std::pow(10, 1 + 4 * u(random));
}

bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

/// Sines and cosines of sums of two angles, of sines of them, and products of those: levels of calls.
Program linkage(Slot angles) {
  Writer w(angles);
  std::vector<Slot> results;
  for (Slot k = 0; k < angles; ++k) {
    const Slot sum = w.put(Op::add, w.input(k), w.input((k + 1) % angles));
    const Slot s = w.put(Op::sin, w.input(k)), c = w.put(Op::cos, sum);
    results.push_back(s);
    results.push_back(w.put(Op::mul, s, c));
    results.push_back(w.put(Op::sin, sum));
    if (k % 3 != 0) continue;
    const Slot deeper = w.put(Op::exp, w.put(Op::mul, s, c));
    results.push_back(w.put(Op::cos, deeper));
    results.push_back(w.put(Op::sub, w.put(Op::sin, deeper), w.put(Op::sin, s)));
  }
  return w.finish(std::move(results));
}

long count(const Program& p, bool wide) {
  return std::count_if(p.instructions.begin(), p.instructions.end(), [&](const Instruction& i) {
    return i.part == Part::none && (i.op == Op::sin || i.op == Op::cos) && i.wide == wide;
  });
}

}  // namespace

TEST_CASE("sines: four angles in a call, the others in calls of two and three, one by itself") {
  for (Slot n = 1; n <= 13; ++n) {
    Writer w(n);
    std::vector<Slot> results;
    for (Slot k = 0; k < n; ++k)
      results.push_back(w.put(Op::add, w.put(Op::sin, w.input(k)), w.put(Op::cos, w.input(k))));
    const Program wide = with_wide_sines(w.finish(std::move(results)));
    const Slot left = n % 4 == 1 ? 1 : 0;
    CHECK(count(wide, true) == 2 * ((n - left + 3) / 4));
    CHECK(count(wide, false) == 2 * left);
  }
}

TEST_CASE("sines: machine code and tape agree bit for bit") {
  REQUIRE_CODE(1);
  std::mt19937 random(7);
  int wrong = 0;
  for (Slot n = 1; n <= 24; ++n) {
    const Program program = linkage(n);
    const Tape tape(program);
    const auto machine = Machine::compile(program);
    REQUIRE(machine);
    const std::size_t results = program.results.size();
    std::vector<double> in(n), slow(results), fast(results),
        work(tape.workspace_size() + machine->workspace_size());
    for (int run = 0; run < 500; ++run) {
      for (double& a : in) a = draw(random);
      if (run % 50 == 0) in[run / 50 % n] = run % 100 == 0 ? 1e300 : INFINITY;
      tape.run(in.data(), slow.data(), work.data());
      machine->run(in.data(), fast.data(), work.data());
      for (std::size_t k = 0; k < results; ++k) wrong += !same(slow[k], fast[k]);
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("sines: right to an ulp, whatever the angle") {
  std::mt19937 random(11);
  double worst = 0;
  const auto ulps = [](double v, long double exact) {
    const double size = std::fabs(static_cast<double>(exact));
    return static_cast<double>(std::fabs(v - exact)) / (std::nextafter(size, INFINITY) - size);
  };
  for (int run = 0; run < 100'000; ++run) {
    const double a = draw(random) * (run % 7 == 0 ? 1e12 : 1);
    const SinCos both = sincos_value(a);
    worst = std::max({worst, ulps(both.sin, sinl(a)), ulps(both.cos, cosl(a))});
  }
  CHECK(worst <= 1);
  CHECK(same(sincos_value(-0.0).sin, -0.0));
  CHECK(sincos_value(0).cos == 1);
  CHECK(std::isnan(sincos_value(INFINITY).sin));
  CHECK(std::isnan(sincos_value(NAN).cos));
}

}  // namespace pendula::wide_sines_test
