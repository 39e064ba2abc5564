// Do the equations hold along a proposed continuation of a solution beyond a singular point? Near a
// multiple root, points of the derivative array need not be solutions: z³ = x³ and its first
// derivatives leave z′ nearly free at 0.
#pragma once

#include "dae/points/array_points.hpp"
#include "dae/start/continuations.hpp"

namespace pendula::dae {

/// Up to this part of its unit, two values of a derivative are one: multiple roots
/// are found to some digits only.
constexpr double same_derivative = 1e-2;

class ContinuationCheck {
 public:
  /// numeric: the derivative array by which continuations were found, for the units of its columns. Both
  /// outlive it.
  ContinuationCheck(const Model& model, const NumericArray& numeric);

  /// Of every derivative in which the continuation differs from others: it is that of the expansion at the
  /// point, and near the point the residuals grow where it is changed by a tenth, in either direction.
  bool holds(const Continuation& continuation) const;

  /// The equations have a solution near the continuation a little later: none near z = 0 where z² = -t³.
  /// Values of every unknown and derivative are moved as little as possible (Gauss-Newton).
  bool exists_along(const Continuation& continuation, const ContinuationExpansion& along) const;
  bool exists_along(const Continuation& continuation) const;

  const NumericArray& numeric() const { return numeric_; }
  double unit_of(Expr leaf) const;

 private:
  ContinuationExpansion straight(const Continuation& continuation) const;
  struct Place {
    std::size_t leaf, order;  ///< in the lists of an expansion
  };
  bool is_least(const Continuation& continuation, const ContinuationExpansion& along, Place place,
                double unit) const;
  Vec residuals(const Continuation& continuation, const ContinuationExpansion& along, double h) const;

  const Model& model_;
  const NumericArray& numeric_;
  double scale_;  ///< of time, in which an unknown changes by its unit
};

/// The derivatives that the equations do not determine where ∂F/∂(x′, z) loses rank: z′ of the algebraic
/// variables in its null space, x″ where there are none. values: of every leaf of the equations.
std::vector<Expr> undetermined(const Model& model, const PointValues& values);

/// Names a continuation by its values of these derivatives, where it has them.
void name_by(Continuation& continuation, const std::vector<Expr>& leaves, const ContinuationCheck& check);

/// The continuation of a solution that has reached a point where x′ and z are not determined: "z′ = 0" of z
/// (x - z²) at x = 0. Nothing where the equations have no solution near its polynomial a little later. at:
/// values there, with t and parameters.
std::optional<Continuation> arrived_continuation(const Model& model, const PointValues& at,
                                                 const ContinuationExpansion& arrived);

}  // namespace pendula::dae
