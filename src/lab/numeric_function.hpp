// A function r: ℝⁿ → ℝᵐ as numbers, with the user's names for messages. The laboratories (Newton,
// Gauss–Newton) work on these: compiled from expressions, or a callback whose derivatives are unknown.
#pragma once

#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/epsilon.hpp"
#include "base/math.hpp"
#include "expr/graph/graph.hpp"

namespace pendula::lab {

struct NumericFunction {
  std::vector<std::string> unknowns;  ///< n names
  int outputs = 0;                    ///< m
  /// r(x), m values already sized. May give NaN or inf.
  std::function<void(const Vec& x, Vec& r)> value;
  /// ∂r/∂x, m × n already sized, exact. Empty: not known.
  std::function<void(const Vec& x, Mat& J)> jacobian;
  /// Σ wᵢ ∇²rᵢ, n × n, exact. Empty: not known.
  std::function<void(const Vec& x, const Vec& w, Mat& S)> curvature;
  /// Which part of which equation is not finite at x: "equation 2: 'log(x - 1)' at x = 0.5". May be empty.
  std::function<std::string(const Vec& x)> undefined;

  int n() const { return static_cast<int>(unknowns.size()); }
};

/// Compiles r as a function of the leaves x; every other leaf must have a value.
/// Throws Error naming a leaf without value. Cost: one compilation of r and of its Jacobian; the second
/// derivatives are compiled on first use.
NumericFunction compile(std::vector<Expr> r, std::vector<Expr> x,
                        const std::unordered_map<Expr, double>& values);

/// A matrix of expressions of the same leaves (m × n, column by column) as a numeric function of x.
std::function<void(const Vec&, Mat&)> compile_matrix(std::vector<Expr> columns, std::vector<Expr> x,
                                                     const std::unordered_map<Expr, double>& values);

/// ∂r/∂x by one-sided differences with steps h·max(|xⱼ|, 1); h = 0: √ε.
void difference_jacobian(const NumericFunction& f, const Vec& x, const Vec& r, double h, Mat& J);

/// The rounding error of a function, relative to the sum |∂r/∂x| |x| of its terms: a few operations per term.
inline constexpr double rounding_of_terms = 8 * eps;
/// Of the largest component of a direction: smaller ones are dropped, those that differ by less are equal.
/// Reports have four digits, and singular vectors an error of √ε at worst.
inline constexpr double no_component = 1e-6;
/// A direction in the user's names: "(x, y) ∝ (1, -2)".
std::string direction_text(const std::vector<std::string>& names, Vec v);

/// Lines of at most `columns` columns, broken at blanks; no newline at the end.
std::string wrapped(const std::string& words, int columns = 100);

/// A condition number with one digit ("3e+04"), the exact ones small enough to read as they are ("4.2").
std::string condition_text(double condition);

/// The part of a matrix that decides whether it is singular, whatever the units: rows and columns are scaled
/// to largest entries of 1 before the singular values are taken.
struct Conditioning {
  double smallest = 0, largest = 0;  ///< singular values of the scaled matrix
  Vec null_vector;                   ///< n: the direction J sees least, largest component 1
  Vec combination;                   ///< m: the combination of rows that depends least on x, largest 1
  double condition() const;          ///< largest / smallest, infinite if singular
};
/// `scale`: the sizes that count as large, entry by entry (at a singular root J itself
/// has become small); default |J|.
Conditioning conditioning(const Mat& J, const Mat& scale = {});

}  // namespace pendula::lab
