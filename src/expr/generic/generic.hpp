// Generic properties: true at almost all values of the symbols, found at random points.
//
// Expressions are evaluated modulo the prime 2⁶¹ - 1: exact, so that elimination may run on the values. A
// rational function that is not identically zero vanishes there with probability below degree/10¹⁸ (Schwartz,
// J. ACM 27(4), 1980). sin and cos of one angle are drawn as a point of the unit circle, exponentials as
// powers of one number, with the addition theorems; roots are roots where there are any; every other function
// is drawn like a symbol. Points come from fixed seeds: the answers are the same in every run.
#pragma once

#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

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

/// The outputs at a random point. Throws Error if one divides by what vanishes for all values.
std::vector<Residue> residues(std::span<const Expr> outputs);

/// The substitute of ifelse, abs, sign, min and max: a value of its own, or one of the two regions.
enum class Pieces { drawn, first, second };

/// The outputs at the point of a seed; empty if they are not defined there (a division by zero).
std::vector<Residue> residues_at(std::span<const Expr> outputs, std::uint64_t seed, Pieces pieces);

/// Are all operations such that residues know their identities? Not powers like x^0.3, logarithms, arcus
/// functions: these are values of their own for every value of their arguments. `pieces`: ifelse, abs, sign,
/// min and max are allowed, since one region is taken.
bool decided_by_residues(std::span<const Expr> outputs, bool pieces = false);

/// Does e vanish for all values of its symbols? Where functions other than those above are in it, a value
/// that cancels to rounding at random points in double precision counts as zero.
bool is_zero(Expr e);

}  // namespace pendula::generic
