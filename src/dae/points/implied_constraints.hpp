// Constraints that follow from others of them where all hold, as in an overconstrained mechanism.
//
// The gradients of 0 = C(q) depend on each other at every position near one, though not generically:
// Bricard's linkage, a parallelogram with a third crank, a circle written as a sphere, a plane and a
// cylinder. By the theorem of constant rank r of them imply all others near there. A singular
// position is different: the gradients are dependent there, but not at positions nearby, and no
// constraint follows from others.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "base/math.hpp"
#include "dae/model/model.hpp"
#include "dae/points/array_points.hpp"

namespace pendula::dae {

struct ConstraintRank {
  enum class Verdict {
    no_position,  ///< none was found
    independent,  ///< the gradients are independent at the position
    singular,     ///< they depend on each other there, but are independent nearby
    implied       ///< those that are not in `kept` follow from these, also nearby
  } verdict = Verdict::no_position;
  int rank = 0, beside = 0;                ///< of ∂C/∂q at the position, and nearby
  std::vector<int> kept;                   ///< with independent gradients
  std::unordered_set<Expr> free;           ///< coordinates that these let move
  std::unordered_map<Expr, double> sizes;  ///< of the coordinates: |q| there, or the unit of one that is 0
  std::unordered_map<Expr, double>
      units;  ///< of the coordinates, as far as C determines them (magnitudes.hpp)
  std::unordered_map<Expr, double> position;  ///< implied: values of all symbols of C that satisfy them
};

class ConstraintPositions {
 public:
  static constexpr std::size_t affordable = 100;  ///< coordinates; a search factorises its Jacobian often

  /// Parameters without value and t are drawn.
  ConstraintPositions(const std::vector<Expr>& C, std::vector<Expr> q, const ParameterValues& values);

  /// At the position that the search from these values finds; 0 where there is none.
  ConstraintRank near(const std::unordered_map<Expr, double>& values) const;
  /// Of the coordinates, as far as C determines them.
  const Vec& units() const { return all_.unit(); }
  /// At positions found from seeded values. Where they differ, the one where coordinates move that are fixed
  /// at the others, otherwise the one of largest rank.
  ConstraintRank anywhere() const;

 private:
  using Known = std::unordered_map<Expr, double>;
  std::optional<Vec> position(const Vec& from, const Known& known) const;
  ConstraintRank judge(const Vec& at, const Known& known) const;
  std::vector<int> well_conditioned(Mat J) const;
  double driven_speed(const NumericArray& kept, const std::vector<int>& rows, const Vec& at,
                      const Known& known) const;
  bool hold_nearby(ConstraintRank& found, const NumericArray& kept, const Vec& at, const Known& known) const;
  bool all_hold(const Vec& at, const Known& known) const;

  std::vector<Expr> C_, q_;
  NumericArray all_;
  bool depends_on_time_;
};

}  // namespace pendula::dae
