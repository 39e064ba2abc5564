// Points that satisfy F_k = 0, and the ranks of the derivative array there.
#pragma once

#include <optional>
#include <unordered_map>

#include "base/math.hpp"
#include "dae/index/derivative_array.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {

struct RankGap {
  int rank = 0;
  double gap = 0;  ///< σ_r / σ_{r+1}, rounding level taken as the least σ; a lower bound where QR proves it
};
constexpr double clear_gap = 1e6;  ///< between singular values that count and those that do not

/// Rank after equilibration of rows and columns, cut at the widest gap of singular values below 1e-8 σ₁: by a
/// QR factorisation with pivoting where its bounds show that gap, by the singular values elsewhere. Cost:
/// O(r c min(r, c)), ten times less where QR is enough.
RankGap rank_with_gap(const Mat& m);

struct ArrayRanks {
  int all = 0, y = 0, higher = 0;  ///< of ∂F_k/∂(x, y), ∂F_k/∂y, and the latter without the columns of x′
  double gap = 0;
  bool slow = false;  ///< Gauss-Newton converged linearly: the Jacobian loses rank at the solution
};

/// The numeric derivative array at one k. All functions of time but the unknowns get values of their own.
class NumericArray {
 public:
  explicit NumericArray(const DerivativeArray& array);
  /// Any equations in any unknowns.
  NumericArray(std::vector<Expr> rows, std::vector<Expr> columns);

  /// Values for t, inputs, parameters without value: drawn from the seed and the name, the same for every k.
  std::unordered_map<Expr, double> known(int seed) const;

  /// From `w` to a solution of F_k = 0, the first `held` unknowns kept; nothing if there is none near.
  struct Solution {
    Vec w;
    bool slow;
  };
  std::optional<Solution> project(Vec w, const std::unordered_map<Expr, double>& known,
                                  Eigen::Index held) const;

  /// `y_only`: the point was found with x held, so that ranks of y are what can be said.
  ArrayRanks ranks(const Solution& at, const std::unordered_map<Expr, double>& known) const;

  const std::vector<Expr>& columns() const { return columns_; }

  /// The starting values of a seed; `continued` where it has a value.
  Vec start(int seed, const std::unordered_map<Expr, double>& continued = {}) const;

 private:
  void prepare();
  void evaluate_at(const Vec& w, const std::unordered_map<Expr, double>& known, Vec& r, Mat& J) const;

  std::vector<Expr> columns_, outputs_, others_;  ///< others: leaves of the outputs that are no columns
  std::vector<Entry> entries_;
  std::size_t rows_, states_, first_;
  mutable std::optional<Evaluator> evaluator_;  ///< of outputs_, made when it is needed
};

/// Values at w, and which of them are cancellation: as large as their change when w moves by 1e-10. Scaling
/// would make numbers of such a 1e-16.
struct StableValues {
  std::vector<double> value;
  std::vector<char> noise;
};
StableValues evaluate_stable(const std::vector<Expr>& outputs, const std::vector<Expr>& columns, const Vec& w,
                             const std::unordered_map<Expr, double>& known);
/// The same for an evaluator whose leaves are those of w, and then others with these values.
StableValues evaluate_stable(const Evaluator& outputs, const Vec& w, std::span<const double> others);

}  // namespace pendula::dae
