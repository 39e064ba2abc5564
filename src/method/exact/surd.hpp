// Numbers a + b√d with rational a, b: the exact coefficients of most tableaus in textbooks.
// With one d for a whole tableau they form an ordered field, so determinants, polynomials and
// signs are decided and not guessed.
//
// The folder has the numbers that src/method computes with: surd.hpp (here), polynomial.hpp over them, and
// precise.hpp for coefficients in no such field: numbers with many digits.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "method/exact/precise.hpp"

namespace pendula::integrate {

class Surd {
 public:
  Surd() = default;
  Surd(long value) : a_(value) {}
  Surd(mpq_class value) : a_(std::move(value)) {}
  Surd(mpq_class a, mpq_class b, long d) : a_(std::move(a)), b_(std::move(b)), d_(b_ == 0 ? 0 : d) {}

  bool is_zero() const { return a_ == 0 && b_ == 0; }
  bool is_rational() const { return d_ == 0; }
  const mpq_class& rational_part() const { return a_; }
  long radicand() const { return d_; }  ///< 0 for a rational number
  int sign() const;

  // Both operands lie in the same field: the radicands agree or one is 0. Else Error (a
  // caller checks with one_field).
  friend Surd operator+(const Surd& x, const Surd& y);
  friend Surd operator-(const Surd& x, const Surd& y);
  friend Surd operator*(const Surd& x, const Surd& y);
  friend Surd operator/(const Surd& x, const Surd& y);
  Surd operator-() const { return Surd(-a_, -b_, d_); }
  Surd& operator+=(const Surd& y) { return *this = *this + y; }
  Surd& operator-=(const Surd& y) { return *this = *this - y; }
  Surd& operator*=(const Surd& y) { return *this = *this * y; }
  friend bool operator==(const Surd& x, const Surd& y) {
    return x.d_ == y.d_ && x.a_ == y.a_ && x.b_ == y.b_;
  }

  Expr expr() const;  ///< "1/4 - √3/6"
  Real real(mp_bitcnt_t bits) const;
  double value() const { return nearest_double(real(192)); }  ///< 139 bits of a + b √d may cancel

 private:
  mpq_class a_ = 0, b_ = 0;
  long d_ = 0;
};

/// The exact value of an expression of fractions and square roots of fractions, if it lies in one field
/// ℚ(√d); nothing for other numbers, for doubles, and for decimals of more than 12 digits (they stand for
/// other numbers).
std::optional<Surd> exact_surd(Expr e);

/// All of them in one field ℚ(√d).
bool one_field(std::span<const Surd> numbers);

}  // namespace pendula::integrate
