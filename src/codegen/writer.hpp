// Writes programs that do not come from expressions: eliminations, whole steps of a method.
#pragma once

#include <map>

#include "codegen/program.hpp"

namespace pendula::codegen {

class Writer {
 public:
  explicit Writer(std::size_t inputs) { program_.inputs = inputs; }

  Slot input(std::size_t k) const { return static_cast<Slot>(k); }
  Slot constant(double value);
  Slot put(Op op, Slot a, Slot b = 0);
  /// Σ factors[i] · values[i] from left to right; zero factors are left out. Nothing left: the constant 0.
  Slot combination(std::span<const double> factors, std::span<const Slot> values);
  /// The results of another program when its inputs are these values.
  std::vector<Slot> inlined(const Program& other, std::span<const Slot> inputs);

  std::size_t size() const { return program_.instructions.size(); }
  Program finish(std::vector<Slot> results);

 private:
  static constexpr Slot constants_from = 0x8000'0000u;  ///< their number is known at the end only
  Slot final(Slot value) const;
  Program program_;
  std::map<std::uint64_t, Slot> constant_;  ///< by the bits of the number
};

}  // namespace pendula::codegen
