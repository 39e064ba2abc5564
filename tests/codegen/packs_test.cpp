// Wide instructions: the same bits as without them, and fewer operations where equations are alike.
#include "codegen/program/packs.hpp"

#include <bit>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "codegen/machine/machine.hpp"
#include "codegen/program/contract.hpp"
#include "codegen/program/writer.hpp"
#include "codegen/tape/tape.hpp"
#include "tests/require_code.hpp"

namespace pendula::packs_test {

using namespace pendula::codegen;

namespace {

/// Bodies that repel each other with the inverse square of their distance; results body after
/// body or component after component.
Program bodies(Slot n, bool interleaved) {
  Writer w(3 * n);
  const auto place = [&](Slot body, Slot c) { return w.input(interleaved ? 3 * body + c : c * n + body); };
  std::vector<Slot> results(3 * n);
  for (Slot i = 0; i < n; ++i) {
    std::array<Slot, 3> force{w.constant(0.5), w.constant(0.25), w.constant(0.125)};
    for (Slot j = 0; j < n; ++j) {
      if (j == i) continue;
      std::array<Slot, 3> d{}, near{};
      for (Slot c = 0; c < 3; ++c) {
        d[c] = w.put(Op::sub, place(i, c), place(j, c));
        near[c] = i < j ? d[c] : w.put(Op::sub, place(j, c), place(i, c));
      }
      Slot r2 = w.put(Op::mul, near[0], near[0]);
      for (Slot c = 1; c < 3; ++c) r2 = w.put(Op::add, w.put(Op::mul, near[c], near[c]), r2);
      const Slot share = w.put(Op::div, w.constant(1), w.put(Op::mul, w.put(Op::sqrt, r2), r2));
      for (Slot c = 0; c < 3; ++c) force[c] = w.put(Op::add, w.put(Op::mul, share, d[c]), force[c]);
    }
    for (Slot c = 0; c < 3; ++c) results[interleaved ? 3 * i + c : c * n + i] = force[c];
  }
  return w.finish(std::move(results));
}

/// Rows of one random shape over random inputs, some of them the same, with functions that are calls between.
Program random_rows(std::mt19937& random, Slot rows) {
  constexpr Slot inputs = 11;
  const auto draw = [&](Slot n) { return static_cast<Slot>(random() % n); };
  Writer w(inputs);
  std::vector<std::vector<Slot>> row(rows);
  for (auto& values : row)
    for (int k = 0; k < 4; ++k)
      values.push_back(draw(6) == 0 ? w.constant(draw(3) + 0.5) : w.input(draw(inputs)));
  std::vector<Slot> results;
  for (int step = 0; step < 30; ++step) {
    constexpr std::array ops = {Op::add, Op::sub, Op::mul, Op::add, Op::mul, Op::div, Op::sqrt,
                                Op::neg, Op::abs, Op::max, Op::min, Op::lt,  Op::sin, Op::ifelse};
    const Op op = ops[draw(ops.size())];
    const auto size = static_cast<Slot>(row[0].size());
    const Slot a = draw(size), b = draw(size), c = draw(size);
    for (auto& values : row) {
      const bool turned = draw(4) == 0 && (op == Op::add || op == Op::mul);
      values.push_back(w.put(op, values[turned ? b : a], info(op).arity > 1 ? values[turned ? a : b] : 0,
                             info(op).arity > 2 ? values[c] : 0));
    }
    if (draw(8) == 0) std::swap(row[draw(rows)].back(), row[draw(rows)].back());
  }
  for (int back = 1; back <= 6; ++back)
    for (const auto& values : row) results.push_back(values[values.size() - static_cast<std::size_t>(back)]);
  return w.finish(std::move(results));
}

std::size_t wide(const Program& p) {
  std::size_t count = 0;
  for (const Instruction& i : p.instructions) count += i.wide;
  return count;
}

/// Outputs of machine code that differ from those of the tape, at some points.
int differences(const Program& program, std::mt19937& random) {
  const Tape tape(program);
  const auto machine = Machine::compile(program);
  std::vector<double> in(program.inputs), work(tape.workspace_size() + machine->workspace_size());
  std::vector<double> slow(program.results.size()), fast(slow);
  int count = 0;
  for (int point = 0; point < 5; ++point) {
    for (double& x : in) x = std::uniform_real_distribution(-2.0, 2.0)(random);
    if (point == 4) in[0] = NAN, in[1] = INFINITY, in[2] = -0.0;
    tape.run(in.data(), slow.data(), work.data());
    machine->run(in.data(), fast.data(), work.data());
    for (std::size_t k = 0; k < slow.size(); ++k)
      count += std::bit_cast<std::uint64_t>(slow[k]) != std::bit_cast<std::uint64_t>(fast[k]) &&
               !(std::isnan(slow[k]) && std::isnan(fast[k]));
  }
  return count;
}

}  // namespace

TEST_CASE("packs: bodies that attract each other take a third of the operations, to the bit") {
  REQUIRE_CODE(4);
  std::mt19937 random(7);
  for (const bool interleaved : {false, true})
    for (const Slot n : {8U, 11U, 13U}) {
      CAPTURE(n);
      const Program before = bodies(n, interleaved), after = packed(before);
      CHECK(wide(after) > 0);
      CHECK(3 * after.instructions.size() < (interleaved ? 2 : 1) * before.instructions.size() * 3 / 2);
      CHECK(differences(before, random) == 0);
    }
}

TEST_CASE("packs: a single equation, and equations without likeness, stay what they are") {
  Writer w(4);
  Slot sum = w.input(0);
  for (Slot k = 0; k < 40; ++k) sum = w.put(k % 3 == 0 ? Op::mul : Op::add, sum, w.input(k % 4));
  CHECK(wide(packed(w.finish({sum, sum, sum, sum}))) == 0);
}

TEST_CASE("packs: rows of random shapes, with calls, repeated operands and exchanged ones, to the bit") {
  REQUIRE_CODE(4);
  std::mt19937 random(11);
  int used = 0;
  for (int k = 0; k < 300; ++k) {
    CAPTURE(k);
    const Program program = random_rows(random, static_cast<Slot>(3 + k % 7));
    used += wide(packed(program)) > 0;
    CHECK(differences(program, random) == 0);
  }
  CHECK(used > 100);
}

TEST_CASE("packs: with fused products, the values to rounding") {
  REQUIRE_CODE(4);
  const Program program = bodies(9, false);
  const auto exact = Machine::compile(program), fused = Machine::compile(program, 1, Rounding::fused);
  std::vector<double> in(program.inputs), a(program.results.size()), b(a);
  std::vector<double> work(exact->workspace_size() + fused->workspace_size());
  for (std::size_t k = 0; k < in.size(); ++k) in[k] = std::sin(static_cast<double>(k * k));
  exact->run(in.data(), a.data(), work.data());
  fused->run(in.data(), b.data(), work.data());
  for (std::size_t k = 0; k < a.size(); ++k) CHECK(b[k] == doctest::Approx(a[k]).epsilon(1e-12));
}

}  // namespace pendula::packs_test
