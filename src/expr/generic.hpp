// What is true of an expression at almost all values of its symbols, found at random points.
//
// A rational expression is evaluated modulo the prime 2⁶¹ - 1: a value that is not identically zero vanishes
// there with probability below degree/10¹⁸ (Schwartz, J. ACM 27(4), 1980). Other functions are evaluated in
// double precision, with a bound on what rounding may leave. Points are drawn from fixed seeds: the answers
// are the same in every run.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "expr/graph.hpp"

namespace pendula::generic {

/// An element of the field of integers modulo 2⁶¹ - 1.
struct Residue {
  std::uint64_t value = 0;
  friend Residue operator+(Residue a, Residue b);
  friend Residue operator-(Residue a, Residue b);
  friend Residue operator*(Residue a, Residue b);
  friend Residue operator/(Residue a, Residue b);  ///< requires b nonzero
  bool is_zero() const { return value == 0; }
};

/// A double that knows how large the terms were from which it came, so that cancellation to rounding is zero.
struct Real {
  double value = 0, scale = 0;
  friend Real operator+(Real a, Real b);
  friend Real operator-(Real a, Real b);
  friend Real operator*(Real a, Real b);
  friend Real operator/(Real a, Real b);
  bool is_zero() const;
};

/// The outputs at a random point; nothing if one of them is not a rational function.
std::optional<std::vector<Residue>> residues(std::span<const Expr> outputs);
/// The same in double precision. Unspecified functions are drawn like symbols. May hold NaN if no point of
/// the domain was found.
std::vector<Real> reals(std::span<const Expr> outputs);

/// Does e vanish for all values of its symbols?
bool is_zero(Expr e);

}  // namespace pendula::generic
