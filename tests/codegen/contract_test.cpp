// Fused products and sums: the same values to rounding, and one rounding where there were two.
#include <array>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "codegen/machine/machine.hpp"
#include "codegen/program/contract.hpp"
#include "codegen/program/writer.hpp"
#include "tests/require_code.hpp"

namespace pendula::contract_test {

using namespace pendula::codegen;

namespace {

/// Every shape: a·b + c, c + a·b, a·b - c, c - a·b, a product used twice, one that is a result, two products.
Program shapes() {
  Writer w(4);
  const Slot a = w.input(0), b = w.input(1), c = w.input(2), d = w.input(3);
  const Slot ab = w.put(Op::mul, a, b), cd = w.put(Op::mul, c, d), ad = w.put(Op::mul, a, d);
  const Slot bc = w.put(Op::mul, b, c), ac = w.put(Op::mul, a, c), bd = w.put(Op::mul, b, d);
  std::vector<Slot> results{w.put(Op::add, ab, c), w.put(Op::add, d, cd), w.put(Op::sub, ad, b),
                            w.put(Op::sub, a, bc)};
  results.push_back(w.put(Op::add, ac, w.put(Op::mul, d, d)));
  results.push_back(w.put(Op::sub, w.put(Op::mul, a, a), w.put(Op::mul, b, b)));
  results.push_back(w.put(Op::add, bd, a));
  results.push_back(bd);
  return w.finish(std::move(results));
}

std::size_t products(const Program& p) {
  std::size_t count = 0;
  for (const Instruction& i : p.instructions) count += i.part == Part::none && i.op == Op::mul;
  return count;
}

}  // namespace

TEST_CASE("contract: products with one use join their sums") {
  const Program before = shapes(), after = contracted(before);
  CHECK(products(before) == 9);
  CHECK(products(after) == 3);  // the shared one, and one in each sum of two products
  CHECK(after.instructions.size() == before.instructions.size() - 6);
}

TEST_CASE("contract: divisions by constants, and again by the same, become products") {
  Writer w(3);
  const Slot a = w.input(0), b = w.input(1), c = w.input(2);
  std::vector<Slot> results{w.put(Op::div, a, b), w.put(Op::div, c, b), w.put(Op::div, a, w.constant(3)),
                            w.put(Op::div, b, c)};
  const Program program = w.finish(std::move(results)), after = contracted(program);
  const auto divisions = [](const Program& p) {
    std::size_t count = 0;
    for (const Instruction& i : p.instructions) count += i.part == Part::none && i.op == Op::div;
    return count;
  };
  CHECK(divisions(program) == 4);
  CHECK(divisions(after) == 2);  // 1/b, and b/c
  REQUIRE_CODE(1);
  const auto fused = Machine::compile(program, 1, Rounding::fused);
  const std::array in{0.7, -1.3, 2.9};
  std::array<double, 4> out{};
  std::vector<double> work(fused->workspace_size() + 1);
  fused->run(in.data(), out.data(), work.data());
  const std::array exact{in[0] / in[1], in[2] / in[1], in[0] / 3, in[1] / in[2]};
  for (std::size_t k = 0; k < 4; ++k)
    CHECK(std::fabs(out[k] - exact[k]) <= 2 * 0x1p-52 * std::fabs(exact[k]));
}

TEST_CASE("contract: values") {
  REQUIRE_CODE(1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-2, 2);
  for (int lanes : {1, 4}) {
    if (!Machine::available(lanes)) continue;
    const auto exact = Machine::compile(shapes(), lanes);
    const auto fused = Machine::compile(shapes(), lanes, Rounding::fused);
    const auto size = static_cast<std::size_t>(lanes);
    std::vector<double> in(4 * size), one(8 * size), other(8 * size), work(100 * size);
    for (int run = 0; run < 1000; ++run) {
      for (double& x : in) x = u(random);
      exact->run(in.data(), one.data(), work.data());
      fused->run(in.data(), other.data(), work.data());
      for (std::size_t k = 0; k < one.size(); ++k)
        CHECK(std::fabs(one[k] - other[k]) <= 4 * 0x1p-52);  // |a b| ≤ 4: one rounding more, or less
    }
  }
}

TEST_CASE("contract: random sums need registers again and again") {
  REQUIRE_CODE(1);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int run = 0; run < 50; ++run) {
    constexpr std::size_t inputs = 30;
    Writer w(inputs);
    std::vector<Slot> values;
    for (std::size_t k = 0; k < inputs; ++k) values.push_back(w.input(k));
    const auto any = [&] { return values[random() % values.size()]; };
    for (int k = 0; k < 300; ++k) {
      const Op op = std::array{Op::add, Op::sub, Op::mul, Op::mul}[random() % 4];
      const Slot x = w.put(op, any(), any());
      values.push_back(w.put(Op::mul, w.constant(0.4), x));  // sizes stay near 1
    }
    std::vector<Slot> results(values.end() - 40, values.end());
    const Program program = w.finish(std::move(results));
    const auto exact = Machine::compile(program), fused = Machine::compile(program, 1, Rounding::fused);
    std::vector<double> in(inputs), one(40), other(40), work(2000);
    for (double& x : in) x = u(random);
    REQUIRE(std::max(exact->workspace_size(), fused->workspace_size()) <= work.size());
    exact->run(in.data(), one.data(), work.data());
    fused->run(in.data(), other.data(), work.data());
    for (std::size_t k = 0; k < one.size(); ++k)
      CHECK(std::fabs(one[k] - other[k]) <= 1e-13 * (1 + std::fabs(one[k])));  // 600 roundings
  }
}

}  // namespace pendula::contract_test
