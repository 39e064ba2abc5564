// Collected forms as quotients of coprime polynomials over ℚ in their atoms.
//
// Generators are the atoms that no polynomial can look into: leaves, functions, calls, powers with symbolic
// exponents, and d-th roots where exponents are no whole numbers. What is known between generators,
// (a^(1/d))^d = a and sin² + cos² = 1, decides whether a form vanishes; with it the ring is no longer one
// with unique factors, so it is applied only where it makes the numerator shorter.
#pragma once

#include <optional>
#include <vector>

#include "expr/normal/normal.hpp"

namespace pendula {

/// coefficient · Π baseᵉ, e ≠ 0 whole; bases are collected sums in textbook sign.
struct RationalForm {
  mpq_class coefficient = 1;
  struct Power {
    SumId base;
    long exponent;
  };
  std::vector<Power> powers;
};

enum class Factoring {
  denominator,  ///< numerator multiplied out, denominator in factors
  both          ///< numerator and denominator in irreducible factors over ℚ
};

/// The quotient of coprime polynomials that equals a sum, coefficient 0 where it vanishes. Nothing where it
/// contains doubles, is too long for algebra at interactive speed, or where FLINT is missing.
std::optional<RationalForm> rational_form(NormalForms& forms, SumId s, Factoring factoring);

/// The greatest common divisor of two sums (monic in its first term), where it is no constant.
std::optional<SumId> common_divisor(NormalForms& forms, SumId a, SumId b);

/// Coefficients c₀ … cₙ of a sum that is a polynomial in x of degree n ≥ 0, after
/// cancelling; nothing where it is none.
std::optional<std::vector<Expr>> polynomial_coefficients(Expr e, Expr x);

/// Numerator and denominator of e, coprime over ℚ and multiplied out.
struct Quotient {
  Expr numerator, denominator;
};
/// throws    Error where e has doubles or is too long, or FLINT is missing
Quotient quotient_of(Expr e);

/// e in irreducible factors over ℚ, common factors of numerator and denominator cancelled.
/// throws    as quotient_of
Expr factored(Expr e);
/// The factors of the numerator with their multiplicities, constants left out.
/// throws    as quotient_of
std::vector<std::pair<Expr, long>> numerator_factors(Expr e);

/// A term of a sum of products: coefficient (free of x) times factors that contain x.
struct SeparatedTerm {
  Expr coefficient;
  std::vector<std::pair<Expr, mpq_class>> factors;  ///< base and exponent
};
/// The terms of e as it is written, products of sums not multiplied out.
std::vector<SeparatedTerm> separated_terms(Expr e, Expr x);

}  // namespace pendula
