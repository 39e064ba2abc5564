// The part of a large model in which something happens.
//
// Large models are often at rest almost everywhere: a ladder of 10⁵ cells that is driven at one end. An
// equation is at rest when its residual is exactly 0, the x′ in it are 0, and neither t nor an input occurs
// in it. Every unknown (x′ᵢ or zⱼ) is paired with an equation that can determine it, and the pairs are sorted
// by their distance from those that are not at rest. The first of them are a model of their own in which the
// unknowns outside are parameters. As long as the unknowns of its interface, which occur in equations
// outside, keep their values to the last bit, everything outside stays at rest, and the solution of the part
// is that of the whole model: nothing is neglected.
#pragma once

#include <memory>
#include <vector>

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Which unknowns occur in which equation, and the pairs. Unknown i < n is xᵢ with xᵢ′, unknown n + j is zⱼ.
class DependencyGraph {
 public:
  static constexpr int large = 20'000;  ///< unknowns; below, the whole model is as quick

  /// Nothing where a part makes no sense: small models, models with projections, modes, sensitivities or
  /// numeric inputs, and those whose equations cannot be paired. Cost: linear in practice.
  static std::shared_ptr<const DependencyGraph> of(const Problem& problem, int modes, int least = large);

  int size() const { return static_cast<int>(unknown_of_.size()); }
  /// Equations sorted by their distance from those that are not at rest; those that are never reached are
  /// left out. `active`: how many are not at rest. Cost: one evaluation of the residual, and linear.
  std::vector<int> order(Problem& problem, const Point& point, int& active) const;

 private:
  friend struct Subsystem;
  std::vector<int> unknown_of_;            ///< per equation
  std::vector<int> row_start_, unknowns_;  ///< of every equation
  std::vector<int> user_start_, users_;    ///< equations in which an unknown occurs
  std::vector<char> free_;                 ///< equations without t
};

/// A part of a model and where its unknowns are in the whole.
struct Subsystem {
  ProblemPtr problem;
  std::vector<int> x, z;                      ///< ascending
  std::vector<int> interface_x, interface_z;  ///< places in x and z
  bool whole = false;

  /// The first `count` equations of the order; the whole model where that is more than half of it.
  Subsystem(const DependencyGraph& couplings, const ProblemPtr& problem, const Point& rest,
            const std::vector<int>& order, int count);

  Point take(const Point& all) const;             ///< of this part
  void put(const Point& some, Point& all) const;  ///< other entries stay as they are
  Vec take(const Vec& all, int n) const;          ///< one number per unknown of (x, z); n states in the whole
  /// Has the interface moved?
  bool touched(const Point& now, const Point& rest) const;
};

}  // namespace pendula::integrate
