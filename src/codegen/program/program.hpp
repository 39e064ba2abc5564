// A kernel before it becomes code: operations on numbered values. Inputs and constants come first, then one
// value per instruction; operands precede their instruction.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {

using Slot = std::uint32_t;

/// Instructions of more than one operation: parts of a linear system, whose matrix is factored once, every
/// right side solved, components taken out; a product and a sum in one.
enum class Part : std::uint8_t { none, factor, solve, component, fused, gather };

/// An operation on earlier values.
/// factor: the extra operands are the matrix row by row; solve: operand[0] is the factor, the extra operands
/// the right side; component: operand[0] is the solve, operand[1] the number of the component.
/// A factor with a band (band.hpp) has the main diagonal and those below it as extra operands.
/// fused: operands a, b, c; a·b + c for Op::add, a·b - c for Op::sub, c - a·b for Op::neg (contract.hpp).
/// wide: four operations of this kind at once on wide operands (packs.hpp); gather: the extra operands are
/// four numbers that become a wide value; component of a wide value: one of its numbers.
struct Instruction {
  Op op;
  Part part = Part::none;
  bool transposed = false;
  bool wide = false;
  std::array<Slot, 3> operand{};
  int size = 0;          ///< of the linear system
  int band = 0;          ///< diagonals below the main one of a definite matrix; 0: dense, with pivots
  Slot first_extra = 0;  ///< position in Program::extra
  int matrix() const { return band > 0 ? size * (band + 1) : size * size; }
  int extras() const {
    return part == Part::factor ? matrix() : part == Part::solve ? size : part == Part::gather ? width : 0;
  }
  static constexpr int width = 4;  ///< of a wide value
  /// How many of operand[] are values: the number of a component is not.
  int operands() const {
    switch (part) {
      case Part::none:
        return info(op).arity;
      case Part::factor:
      case Part::gather:
        return 0;
      case Part::fused:
        return 3;
      default:
        return 1;
    }
  }
  /// How many numbers it leaves behind: factors (dense ones with pivots), a solution, or one number.
  int results() const {
    if (wide) return width;
    return part == Part::factor ? matrix() + (band > 0 ? 0 : size) : part == Part::solve ? size : 1;
  }
};

struct Program {
  std::size_t inputs = 0;
  std::vector<double> constants;
  std::vector<Instruction> instructions;
  std::vector<Slot> extra;
  std::vector<Slot> results;
  /// Outputs that follow each other, written by a wide value; their entry in `results` is `elsewhere`.
  struct WideResult {
    Slot value, first;
  };
  std::vector<WideResult> wide_results;
  static constexpr Slot elsewhere = 0xffff'ffffu;
  Slot first_instruction() const { return static_cast<Slot>(inputs + constants.size()); }
  const Instruction& of(Slot value) const { return instructions[value - first_instruction()]; }

  /// Calls use(value) for every operand of an instruction.
  template <class Use>
  void each_operand(const Instruction& i, const Use& use) const {
    for (int k = 0; k < i.operands(); ++k) use(i.operand[k]);
    for (int k = 0; k < i.extras(); ++k) use(extra[i.first_extra + static_cast<Slot>(k)]);
  }
};

/// Throws Error naming a leaf that is not among the inputs, or an unspecified function.
Program lower(std::span<const Expr> outputs, std::span<const Expr> inputs);

}  // namespace pendula::codegen
