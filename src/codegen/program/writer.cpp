#include "codegen/program/writer.hpp"

#include <algorithm>
#include <bit>

#include "base/error.hpp"

namespace pendula::codegen {

Slot Writer::constant(double value) {
  const auto next = static_cast<Slot>(program_.constants.size());
  const auto [at, made] = constant_.try_emplace(std::bit_cast<std::uint64_t>(value), constants_from + next);
  if (made) program_.constants.push_back(value);
  return at->second;
}

Slot Writer::put(Op op, Slot a, Slot b, Slot c) { return put(Instruction{.op = op, .operand = {a, b, c}}); }

Slot Writer::put(const Instruction& i) {
  const auto next = static_cast<Slot>(program_.inputs + size());
  if (i.part == Part::none) {
    const auto [at, made] = computed_.try_emplace(Same{i.op, i.operand}, next);
    if (!made) return at->second;
  }
  program_.instructions.push_back(i);
  return next;
}

Slot Writer::combination(std::span<const double> factors, std::span<const Slot> values) {
  PENDULA_ASSERT(factors.size() == values.size(), "a combination with unequal lists");
  Slot sum = 0;
  bool empty = true;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (factors[i] == 0) continue;
    const Slot term = factors[i] == 1 ? values[i] : put(Op::mul, constant(factors[i]), values[i]);
    sum = empty ? term : put(Op::add, sum, term);
    empty = false;
  }
  return empty ? constant(0) : sum;
}

/// Reduces in four independent chains; a single chain would wait for every operation.
Slot Writer::reduced(Op op, std::span<const Slot> terms) {
  constexpr std::size_t chains = 4;
  if (terms.empty()) return constant(0);
  std::vector<Slot> partial(terms.begin(),
                            terms.begin() + static_cast<std::ptrdiff_t>(std::min(chains, terms.size())));
  for (std::size_t k = chains; k < terms.size(); ++k)
    partial[k % chains] = put(op, partial[k % chains], terms[k]);
  for (std::size_t k = 1; k < partial.size(); ++k) partial[0] = put(op, partial[0], partial[k]);
  return partial[0];
}

/// An instruction of another program, with its operands mapped by `here`.
Slot Writer::copied(const Program& other, Instruction i, const std::vector<Slot>& here) {
  for (int k = 0; k < i.operands(); ++k) i.operand[k] = here[i.operand[k]];
  if (i.extras() > 0) {
    const Slot first = static_cast<Slot>(program_.extra.size());
    for (int k = 0; k < i.extras(); ++k)
      program_.extra.push_back(here[other.extra[i.first_extra + static_cast<Slot>(k)]]);
    i.first_extra = first;
  }
  return put(i);
}

std::vector<Slot> Writer::inlined(const Program& other, std::span<const Slot> inputs) {
  PENDULA_ASSERT(inputs.size() == other.inputs, "a program with the wrong number of inputs");
  std::vector<Slot> here(inputs.begin(), inputs.end());
  for (double c : other.constants) here.push_back(constant(c));
  for (const Instruction& i : other.instructions) here.push_back(copied(other, i, here));
  std::vector<Slot> results;
  for (Slot value : other.results) results.push_back(here[value]);
  return results;
}

void Writer::inline_part(const Program& other, std::span<const Slot> inputs,
                         const std::vector<bool>& marked) {
  PENDULA_ASSERT(inputs.size() == other.inputs && marked.size() == other.inputs,
                 "a program with the wrong number of inputs");
  std::vector<Slot> here;
  for (std::size_t k = 0; k < inputs.size(); ++k) here.push_back(marked[k] ? inputs[k] : nothing);
  for (double c : other.constants) here.push_back(constant(c));
  for (const Instruction& i : other.instructions) {
    bool early = i.part == Part::none;
    other.each_operand(i, [&](Slot value) { early = early && here[value] != nothing; });
    here.push_back(early ? copied(other, i, here) : nothing);
  }
}

/// The final number of a value: inputs first, then constants, then instructions.
Slot Writer::final(Slot value) const {
  const auto inputs = static_cast<Slot>(program_.inputs);
  if (value >= constants_from) return inputs + (value - constants_from);
  return value < inputs ? value : value + static_cast<Slot>(program_.constants.size());
}

Program Writer::finish(std::vector<Slot> results) {
  for (Instruction& i : program_.instructions)
    for (int k = 0; k < i.operands(); ++k) {
      Slot& value = i.operand[k];
      value = final(value);
    }
  for (Slot& value : program_.extra) value = final(value);
  for (Slot& value : results) value = final(value);
  program_.results = std::move(results);
  return std::move(program_);
}

}  // namespace pendula::codegen
