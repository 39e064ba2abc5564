// The continuations that solutions have at a singular point.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

using PointValues = std::unordered_map<Expr, double>;

/// A solution through a point at which the equations do not determine x′ and z.
struct Continuation {
  std::string text;           ///< the lowest derivatives in which it differs from the others: "z′ = -1"
  PointValues values;         ///< of t, everything that the point gave, and the first derivatives
  std::vector<Expr> differs;  ///< those derivatives
  std::string choice;         ///< what chooses it: "{ [z.dot] = -1 }"
};

/// The solutions through a singular point. The equations and their derivatives up to the fourth are solved
/// near the point from several values of the derivatives (Gauss-Newton, array_points.hpp).
///
/// point    values of t, states, z and parameters, right to some percent
/// returns  one to four of them, "z′ = -1" and "z′ = 1" where z² = x² and x′ = 1 at 0; none where fewer or
///          more were found, and for large models or those with inputs
std::vector<Continuation> continuations_at(const Model& model, const PointValues& point);

/// "z′ = -1 or z′ = 1", and "{ [z.dot] = -1 } or { [z.dot] = 1 }".
std::string continuations_text(const std::vector<Continuation>& continuations);
std::string choices_text(const std::vector<Continuation>& continuations);

/// Why `branch = { leaf = value }` cannot distinguish solutions of the model that meet, wherever they do, and
/// which values can; "" where it may.
std::string cannot_choose(const Model& model, Expr leaf, double value);

/// The Taylor polynomial of a solution at a point: derivatives of order 0, 1 … p of every state and
/// algebraic variable, as far as the equations and their derivatives determine all of them.
/// at_meeting: branches meet at the point.
struct ContinuationExpansion {
  double t = 0;
  std::vector<std::pair<Expr, std::vector<double>>> derivatives;
  /// Values and derivatives, up to the given order, at another time.
  PointValues at(double time, int highest = std::numeric_limits<int>::max()) const;
  /// The same polynomial about another time.
  ContinuationExpansion about(double time) const;
  /// The larger of the last two terms of a leaf at a distance from t: what is left out is smaller.
  double last_terms(std::size_t leaf, double distance) const;
};
std::optional<ContinuationExpansion> expansion(const Model& model, const Continuation& continuation,
                                               bool at_meeting);

/// The time before `to` at which x′ and z are no longer determined: a zero of det ∂F/∂(x′, z) along the
/// polynomial, with or without a change of sign. others: values of parameters. Nothing where there is none.
std::optional<double> meeting_time(const Model& model, const ContinuationExpansion& continuation,
                                   const PointValues& others, double to);

}  // namespace pendula::dae
