// Polynomials over ℚ in several generators: greatest common divisors and factors.
//
// The algorithms are those of FLINT (fmpq_mpoly), which is opened when the first polynomial is made: linking
// it would cost every start of the program 3 ms.
#pragma once

#include <gmpxx.h>

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace pendula {

/// Whether FLINT is there: without it nothing below may be called.
bool have_polynomials();
/// Throws Error that names the package, where FLINT is missing.
void require_polynomials();

/// The generators of a session; polynomials of one ring can be combined.
class PolynomialRing;
using RingPtr = std::shared_ptr<const PolynomialRing>;
/// Lexicographic order, the first generator is the greatest.
RingPtr polynomial_ring(std::size_t generators);

struct Monomial {
  mpq_class coefficient;
  std::vector<unsigned long> exponents;  ///< one per generator
};

/// An immutable value.
class Polynomial {
 public:
  Polynomial(RingPtr ring, const std::vector<Monomial>& terms);
  static Polynomial constant(RingPtr ring, const mpq_class& value);

  std::vector<Monomial> terms() const;  ///< the greatest first
  std::size_t size() const;             ///< number of terms
  bool is_zero() const { return size() == 0; }
  bool is_one() const;
  bool is_constant() const;
  long total_degree() const;

  friend Polynomial operator+(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b);
  Polynomial power(unsigned long n) const;
  /// Monic; 1 for coprime ones. Nothing where FLINT gives up.
  friend std::optional<Polynomial> gcd(const Polynomial& a, const Polynomial& b);
  /// a/b where b divides a, else nothing.
  friend std::optional<Polynomial> quotient(const Polynomial& a, const Polynomial& b);
  /// Normal form of a modulo the ideal of a Gröbner basis.
  friend Polynomial remainder(const Polynomial& a, std::span<const Polynomial> basis);
  /// Irreducible over ℚ, with multiplicities, and the constant; nothing where FLINT gives up.
  struct Factors;
  std::optional<Factors> factors() const;

 private:
  struct Held;
  explicit Polynomial(std::shared_ptr<const Held> held) : held_(std::move(held)) {}
  std::shared_ptr<const Held> held_;
};

struct Polynomial::Factors {
  mpq_class constant;
  std::vector<std::pair<Polynomial, unsigned long>> powers;
};

}  // namespace pendula
