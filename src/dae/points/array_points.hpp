// Consistent points: values that satisfy the equations of a model and their derivatives, and ranks there.
//
// Whether a rank is lost depends on where it is taken: only points on the solutions count.
// derivative_array.hpp: F and its derivatives as expressions. array_points.hpp (here): points with F_k = 0 by
// Gauss-Newton from seeded starts, and the ranks of the derivative array there. consistent_point_rank.hpp:
// the rank of the system Jacobian at such points. rank_on_zero_set.hpp: the same for a given set of
// equations. generic_functions.hpp: unspecified functions replaced by functions with values.
// interval_proof.hpp: that there are no such points; completed_squares.hpp helps it.
#pragma once

#include <optional>
#include <unordered_map>

#include "base/math.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/rank/stable_values.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {

struct ArrayRanks {
  int all = 0, y = 0, higher = 0;  ///< of ∂F_k/∂(x, y), ∂F_k/∂y, and the latter without the columns of x′
  double gap = 0;
  struct OfPrefix {
    int y, higher;
  };
  std::vector<OfPrefix> prefixes;  ///< of F_0, F_1 … F_{k-1}, which are the first rows, at the same point
  bool slow = false;      ///< Gauss-Newton converged linearly: the Jacobian loses rank at the solution
  bool balanced = false;  ///< ranks of the balanced matrix, which are higher than with largest entries of 1
};

/// The numeric derivative array at one k. All functions of time but the unknowns get values of their own.
class NumericArray {
 public:
  /// far_from_one: units only where some are far from 1. always: they distinguish coefficients that vanish
  /// from small ones.
  enum class Units { far_from_one, always };

  explicit NumericArray(const DerivativeArray& array, Units units = Units::far_from_one);
  /// Any equations in any unknowns; units where the other leaves have the values of
  /// `others`, or those of known(0).
  NumericArray(std::vector<Expr> rows, std::vector<Expr> columns, Units units = Units::far_from_one,
               const std::unordered_map<Expr, double>* others = nullptr);

  /// The same unknowns in another order.
  NumericArray with_columns(std::vector<Expr> order) const;

  /// Takes the size of t from these equations: those of the array at values of their parameters. 1, unless a
  /// row tells a size far from it, as cos(t/T) does.
  void measure_time(const std::vector<Expr>& equations);

  /// Are these values no larger than the units let one expect? The equations may leave some of them open, as
  /// the mass of a mixture of which they tell the composition.
  bool suits(const std::unordered_map<Expr, double>& values) const;
  /// Takes units that the equations leave open from these values.
  void measure_near(const std::unordered_map<Expr, double>& values);

  /// Values for t, inputs, parameters without value: drawn from the seed and the name, the same for every k.
  std::unordered_map<Expr, double> known(int seed) const;

  /// From `w` to a solution of F_k = 0, the first `held` unknowns kept; nothing if there is none near.
  /// negligible: entries of the scaled Jacobian that count as 0: near a singular point, coefficients that
  /// vanish there would determine the highest derivatives from rounding errors.
  struct Solution {
    Vec w;
    bool slow;
  };
  std::optional<Solution> project(Vec w, const std::unordered_map<Expr, double>& known, Eigen::Index held,
                                  double negligible = 0) const;

  /// Ranks of the derivative array at the point.
  ArrayRanks ranks(const Solution& at, const std::unordered_map<Expr, double>& known) const;

  const std::vector<Expr>& columns() const { return columns_; }
  /// The size of every unknown, as far as the equations tell it (magnitudes.hpp); 1 where all are near 1.
  const Vec& unit() const { return unit_; }
  const Vec& row_unit() const { return row_unit_; }  ///< of every row, in the same way
  /// Rows and ∂rows/∂columns at w, in units of rows and columns; entries of J that are cancellation are 0.
  void evaluate_at(const Vec& w, const std::unordered_map<Expr, double>& known, Vec& r, Mat& J) const;
  /// The latter alone.
  Mat jacobian(const Vec& w, const std::unordered_map<Expr, double>& known) const;

  /// The starting values of a seed; `continued` where it has a value.
  Vec start(int seed, const std::unordered_map<Expr, double>& continued = {}) const;

 private:
  void prepare();
  void measure(Units units, const std::unordered_map<Expr, double>& others,
               const std::vector<std::pair<Expr, double>>& anchors = {});

  std::vector<Expr> columns_, outputs_, others_;  ///< others: leaves of the outputs that are no columns
  std::vector<Entry> entries_;
  Vec unit_, row_unit_;
  std::size_t rows_, states_, first_, equations_;
  double time_unit_ = 1;
  bool linear_ = false;                         ///< in the columns
  mutable std::optional<Evaluator> evaluator_;  ///< of outputs_, made when it is needed
};

}  // namespace pendula::dae
