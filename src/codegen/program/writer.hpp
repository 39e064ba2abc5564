// Writes programs that do not come from expressions: eliminations, whole steps of a method. What was computed
// before is not computed again.
#pragma once

#include <map>
#include <unordered_map>

#include "codegen/program/program.hpp"

namespace pendula::codegen {

class Writer {
 public:
  explicit Writer(std::size_t inputs) { program_.inputs = inputs; }

  Slot input(std::size_t k) const { return static_cast<Slot>(k); }
  Slot constant(double value);
  bool is_constant(Slot value) const { return value >= constants_from; }
  Slot put(Op op, Slot a, Slot b = 0, Slot c = 0);
  /// Σ factors[i] · values[i] from left to right; zero factors are left out. Nothing left: the constant 0.
  Slot combination(std::span<const double> factors, std::span<const Slot> values);
  /// Their sum in a few independent chains; nothing: the constant 0.
  Slot sum(std::span<const Slot> terms) { return reduced(Op::add, terms); }
  Slot largest(std::span<const Slot> terms) { return reduced(Op::max, terms); }
  /// The results of another program when its inputs are these values.
  std::vector<Slot> inlined(const Program& other, std::span<const Slot> inputs);
  /// Only that part of it which needs no input but the marked ones, to have it early.
  void inline_part(const Program& other, std::span<const Slot> inputs, const std::vector<bool>& marked);

  std::size_t size() const { return program_.instructions.size(); }
  Program finish(std::vector<Slot> results);

 private:
  static constexpr Slot constants_from = 0x8000'0000u;  ///< their number is known at the end only
  static constexpr Slot nothing = 0xffff'ffffu;
  struct Same {
    Op op;
    std::array<Slot, 3> operand;
    bool operator==(const Same&) const = default;
  };
  struct SameHash {
    std::size_t operator()(const Same& s) const {
      std::size_t h = static_cast<std::size_t>(s.op);
      for (Slot value : s.operand) h = (h ^ value) * 1099511628211ULL;
      return h;
    }
  };
  Slot put(const Instruction& i);
  Slot reduced(Op op, std::span<const Slot> terms);
  Slot copied(const Program& other, Instruction i, const std::vector<Slot>& here);
  Slot final(Slot value) const;
  Program program_;
  std::unordered_map<Same, Slot, SameHash> computed_;
  std::map<std::uint64_t, Slot> constant_;  ///< by the bits of the number
};

}  // namespace pendula::codegen
