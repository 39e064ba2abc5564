// Which value is in which register, and where it is in memory: the bookkeeping of one pass over a program.
// The code for moving values is emitted by whoever owns this.
#pragma once

#include <limits>
#include <optional>

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// A place in memory: number `index` of one of the arrays.
struct Home {
  enum class Array : std::uint8_t { none, input, constant, output, work };
  Array array = Array::none;
  Slot index = 0;
  explicit operator bool() const { return array != Array::none; }
};

/// The order in which instructions run: that of the program, except that within a window calls are moved
/// together, since each call empties the registers.
std::vector<Slot> call_order(const Program& program);
/// Does the operation call a function, or is it a few machine instructions?
bool is_call(const Instruction& i);

class Registers {
 public:
  static constexpr Slot never = std::numeric_limits<Slot>::max();
  Registers(const Program& program, const std::vector<Slot>& order, int count);

  static constexpr int in_memory = -1;                   ///< less than every register
  int of(Slot value) const { return register_[value]; }  ///< its register, or in_memory
  Slot in(int r) const { return value_[r]; }             ///< never: free
  Home& home(Slot value) { return home_[value]; }
  bool is_wide(Slot value) const { return wide_[value]; }
  bool alive(Slot value) const { return next_[value] < last_[value]; }

  /// An operand was read: after its last use its register is free, and its slot from the next instruction on
  /// (the machine instruction that reads the slot may not have been emitted yet).
  void used(Slot value);
  void next_instruction();
  void release(Slot value);
  void assign(int r, Slot value);
  void empty(int r);
  /// A free register, if there is one; and the occupied one that is needed last, `pinned` ones excepted.
  std::optional<int> vacant() const;
  int furthest(unsigned pinned) const;

  Slot new_slot(int numbers = 1);
  Slot new_wide_slot();  ///< on a border of as many numbers as it has
  std::size_t work_size() const { return work_; }

 private:
  std::vector<int> register_;
  std::vector<Slot> value_;
  std::vector<Home> home_;
  std::vector<Slot> uses_, next_, last_;  ///< positions of uses, value by value
  std::vector<char> shared_;              ///< values whose slots are read under other names, too: they stay
  std::vector<char> wide_;
  std::vector<Slot> free_slots_, free_wide_, freed_, freed_wide_;
  Slot work_ = 0;
};

}  // namespace pendula::codegen
