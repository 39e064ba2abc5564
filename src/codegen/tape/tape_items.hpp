// First half of the translation of a program into a tape: the list of its items.
//
// An item is a vector loop, an operation without pattern, or part of a linear system. Every item gets slots
// of its own, numbered behind the inputs and constants; the second half (tape_layout.cpp) fuses the loops,
// puts the items in their final order and gives the slots places in the workspace, which are used again.
//
//   program     v3 = x0·y0   v4 = x1·y1   …   v10 = x7·y7   v11 = v3 + v4   v12 = v11 + v5   …
//   schedule    mul: v3 … v10          add: v11          add: v12          …
//   items       loop mul, 8 members    add v3, v4        add v11, v5       …
#pragma once

#include "codegen/program/program.hpp"
#include "codegen/tape/fused_loops.hpp"

namespace pendula::codegen {

struct TapeItems {
  std::vector<Item> items;
  std::vector<Slot> instruction;  ///< of every item, the first
  std::vector<Slot> slot;         ///< of every value of the program
  std::vector<Slot> owner;        ///< of every slot: its item, or no_owner
  std::size_t in_loops = 0;       ///< operations that are members of loops

  bool is_linear(const Program& program, Slot item) const {
    return program.instructions[instruction[item]].op == Op::solve;
  }
};

/// The items in an order that respects dependences, `gap` slots left free behind the inputs. Cost: linear.
TapeItems items_of(const Program& program, Slot gap);

}  // namespace pendula::codegen
