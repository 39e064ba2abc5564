// Values of a program that is being written, with the operators of algebra: 1 / (atol + rtol * magnitude(x)).
#pragma once

#include "base/error.hpp"
#include "codegen/program/writer.hpp"

namespace pendula::integrate {

using Slots = std::vector<codegen::Slot>;

/// A value of a program, or a number that becomes a constant of the program where it
/// meets one. Conditions are 1 or 0.
class Formula {
 public:
  Formula(double constant) : constant_(constant) {}  // NOLINT: numbers stand in formulas
  Formula(codegen::Writer& writer, codegen::Slot slot) : writer_(&writer), slot_(slot) {}

  codegen::Slot slot(codegen::Writer& w) const { return writer_ ? slot_ : w.constant(constant_); }

  friend Formula operator+(Formula a, Formula b) { return put(Op::add, a, b); }
  friend Formula operator-(Formula a, Formula b) { return put(Op::sub, a, b); }
  friend Formula operator*(Formula a, Formula b) { return put(Op::mul, a, b); }
  friend Formula operator/(Formula a, Formula b) { return put(Op::div, a, b); }
  friend Formula operator-(Formula a) { return put(Op::neg, a); }
  friend Formula operator<(Formula a, Formula b) { return put(Op::lt, a, b); }
  friend Formula operator<=(Formula a, Formula b) { return put(Op::le, a, b); }
  friend Formula both(Formula a, Formula b) { return put(Op::both, a, b); }
  friend Formula either(Formula a, Formula b) { return put(Op::either, a, b); }
  friend Formula lesser(Formula a, Formula b) { return put(Op::min, a, b); }
  friend Formula greater(Formula a, Formula b) { return put(Op::max, a, b); }
  friend Formula multiply_add(Formula a, Formula b, Formula c) { return a * b + c; }  // becomes one operation
  friend Formula magnitude(Formula a) { return put(Op::abs, a); }
  friend Formula square_root(Formula a) { return put(Op::sqrt, a); }
  friend Formula logarithm(Formula a) { return put(Op::log, a); }
  friend Formula exponential(Formula a) { return put(Op::exp, a); }
  friend Formula choose(Formula condition, Formula yes, Formula no) {
    codegen::Writer& w = condition.writer();
    return {w, w.put(Op::ifelse, condition.slot_, yes.slot(w), no.slot(w))};
  }

 private:
  codegen::Writer& writer() const {
    PENDULA_ASSERT(writer_, "a formula of numbers alone");
    return *writer_;
  }
  static Formula put(Op op, Formula a) { return {a.writer(), a.writer().put(op, a.slot_)}; }
  static Formula put(Op op, Formula a, Formula b) {
    codegen::Writer& w = a.writer_ ? *a.writer_ : b.writer();
    return {w, w.put(op, a.slot(w), b.slot(w))};
  }

  codegen::Writer* writer_ = nullptr;
  codegen::Slot slot_ = 0;
  double constant_ = 0;
};

}  // namespace pendula::integrate
