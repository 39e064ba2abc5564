// Numbers with more digits than a double: coefficients of tableaus, so that order conditions are decided and
// not guessed, and every double of a method is the one nearest to the true coefficient.
#pragma once

#include <vector>

#include <gmpxx.h>

#include "expr/graph/graph.hpp"

namespace pendula::integrate {

using Real = mpf_class;
using RealVector = std::vector<Real>;

/// A square matrix of Real, by rows.
class RealMatrix {
 public:
  explicit RealMatrix(int size = 0, mp_bitcnt_t bits = 64)
      : size_(size), entries_(static_cast<std::size_t>(size) * size, Real(0, bits)) {}
  int size() const { return size_; }
  Real& operator()(int i, int j) { return entries_[i * size_ + j]; }
  const Real& operator()(int i, int j) const { return entries_[i * size_ + j]; }

 private:
  int size_;
  RealVector entries_;
};

/// The value of an expression of numbers (+ - × ÷, integer powers, sqrt) to `bits` binary digits.
/// Whatever else it contains (π, cos …, numbers known as doubles only) is taken as a double, and a
/// decimal fraction of more than 12 digits stands for an irrational number in most published tableaus:
/// `error` becomes the largest relative error so far, 2⁻⁵³ or half a unit of the last digit. Throws Error
/// unless the expression is a number.
Real precise_value(Expr e, mp_bitcnt_t bits, double& error);

/// The double nearest to the value; infinite where it is beyond the largest one.
double nearest_double(const Real& value);

/// The double nearest to a coefficient. Throws Error where it is beyond the largest one.
double rounded_coefficient(const Real& value);

}  // namespace pendula::integrate
