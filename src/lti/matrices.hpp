// Small exact matrices: what the algorithms on linear systems have in common, whatever their entries are.
//
// A matrix is exact (all entries rational), numeric (constants, at least one known as a double only) or
// symbolic. Exact matrices stay exact; numeric ones are worked on in doubles; symbolic ones on the graph.
//
// Measured numbers above 10⁹ have so few digits behind the point that every one is the rational number of
// some denominator (1136700163.0743). Rationals without a common denominator of 256 bits are therefore
// numeric: fractions that someone wrote have one, and exact work on others takes minutes and shows nothing.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"
#include "dae/rank/rational_matrix.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::lti {

using Index = Eigen::Index;
using Complex = std::complex<double>;
using ComplexMat = Eigen::MatrixXcd;
using ComplexVec = Eigen::VectorXcd;

enum class Field { exact, numeric, symbolic };
Field field(std::span<const Expr> entries);
inline Field field(const MatX& m) { return field(entries(m)); }
/// The poorer of two: symbolic before numeric before exact.
inline Field common(Field a, Field b) { return a < b ? b : a; }

MatX product(const MatX& a, const MatX& b);
MatX hstack(const MatX& a, const MatX& b);  ///< [a b]
MatX vstack(const MatX& a, const MatX& b);  ///< [a; b]
MatX block_diagonal(const MatX& a, const MatX& b);
MatX scaled(Expr factor, const MatX& m);
/// Symbolic entries simplified.
MatX tidy(const MatX& m);
/// x with a x = b, exact up to 40 rows; nothing where a is singular (symbolic: for
/// all values of the symbols).
std::optional<MatX> solve(const MatX& a, const MatX& b);

/// Doubles as constants; -0 is 0.
MatX expressions(const Mat& m);
/// The entries as rationals, doubles included (a double is one). Requires constants.
dae::RationalMatrix rational(const MatX& m);
/// Entries rounded to doubles.
MatX rounded(const MatX& m);
/// The value of an expression of constants (√2, π). Throws Error that names a symbol in it
double number(Expr e);
Mat numbers(const MatX& m);

/// The default values of the parameters in `all`. Throws Error that names a parameter
/// without value, or another symbol
Substitution defaults(std::span<const Expr> all);

}  // namespace pendula::lti
