// Whether the equations are continuous, or differentiable, across a border: decided from their expressions.
//
// With all branches frozen (surfaces.hpp), a residual is an analytic function of its leaves, F₊ on one side
// of the border s = 0 and F₋ on the other. An analytic function that vanishes at random points of the border
// vanishes on all of it (but for a set of exceptions of measure 0). So:
//
//   D = F₊ - F₋ = 0 on s = 0          the equations are continuous there: a kink
//   and ∂D/∂y = 0 for every leaf y    they are continuously differentiable there: smooth
//
// evaluated at a few random points with s = 0, whatever the modes of the other borders, but for those that
// stay on one side all along this one. D is examined in parts (border_difference.hpp). The answer "yes" is
// right wherever the border is crossed. "No" may be due to a combination of modes that never happens, or to a
// part of the border that a solution never reaches: such borders are judged where they are crossed.
#pragma once

#include <random>
#include <span>
#include <unordered_map>
#include <vector>

#include "integrate/event/surfaces.hpp"

namespace pendula::integrate {

class BorderSmoothness {
 public:
  /// equations and whens, the surface functions: with frozen branches, in modes of these surfaces. parameters
  /// and their values.
  /// Requires that modes and surfaces outlive it.
  BorderSmoothness(std::vector<Expr> equations, const std::vector<Expr>& modes,
                   const std::vector<Surface>& surfaces, std::vector<Expr> whens,
                   const std::vector<Expr>& parameters, std::span<const double> values);

  /// Of a border, by its number among the surfaces.
  Smoothness operator()(std::size_t border) const;

  /// For each of some functions of the unknowns, with frozen branches: is it positive at the border and so
  /// far from 0 that a step which passes the border finds it positive, too? At most random points of the
  /// border its value is then larger than its change where a leaf changes by a tenth, in the modes of both
  /// sides. Points at which it is negative belong to no solution. A function that vanishes with the surface
  /// function changes by more.
  std::vector<char> are_positive_around(std::size_t border, const std::vector<Expr>& functions) const;

 private:
  using Values = std::unordered_map<Expr, double>;
  struct Difference;
  /// A leaf in which the surface function can be made 0, with its partial derivative.
  struct Solvable {
    Expr leaf, slope;
  };
  std::vector<Expr> open_leaves(Expr e) const;
  Substitution settled_modes(std::size_t border) const;
  Difference difference(std::size_t border) const;
  std::vector<Solvable> solvable_leaves(Expr when) const;
  Values random_values(const std::vector<Expr>& inside, std::mt19937& random) const;
  static bool move_onto_border(Expr when, const Solvable& in, Values& values);

  std::vector<Expr> equations_;
  const std::vector<Expr>& modes_;
  const std::vector<Surface>& surfaces_;
  std::vector<Expr> whens_;
  std::vector<std::vector<Expr>> leaves_of_;  ///< of the surface functions, by their numbers
  std::unordered_map<Expr, std::vector<std::size_t>> rows_of_;  ///< that contain a mode
  std::unordered_map<Expr, Mode::Kind> kind_;                   ///< of a mode
  Values known_;                                                ///< parameters
};

}  // namespace pendula::integrate
