// A Butcher tableau is data; everything else about the method is derived from it.
//
//     c₁ │ a₁₁ … a₁ₛ
//     ⋮  │  ⋮     ⋮       Kᵢ = f(x + Δt Σⱼ aᵢⱼ Kⱼ, t + cᵢ Δt),   x₊ = x + Δt Σᵢ bᵢ Kᵢ
//     cₛ │ aₛ₁ … aₛₛ
//     ───┼──────────      Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.1
//        │ b₁  … bₛ
//
// Entries are exact expressions of numbers (1/3, sqrt(3)/6); the doubles of the engine are the nearest ones.
// The constructor rejects what the book rejects, and an order that is claimed is proved.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"
#include "expr/graph/matrix.hpp"
#include "method/order.hpp"

namespace pendula::integrate {

/// x(tₖ + θΔt) ≈ xₖ + Δt Σᵢ bᵢ(θ) Kᵢ with bᵢ(θ) = Σⱼ b(i, j-1) θʲ, over the s stages and e extra ones that
/// are computed only when a value between the mesh points is wanted. The extra stage i is explicit: row i of
/// A holds the coefficients of the stages 1 … s + i - 1. The first extra stage is often c = 1, A = bᵀ: x′ at
/// the new point. (Solving ODEs I, §II.6)
struct DenseData {
  MatX A;                    ///< e × (s + e)
  VecX c;                    ///< e
  MatX b;                    ///< (s + e) × degree
  std::optional<int> order;  ///< a claim, checked
};

struct DenseOutput {  ///< the same in doubles
  Mat A;
  Vec c;
  Mat b;
  int order = 0;
  int extra() const { return static_cast<int>(c.size()); }
};

struct TableauData {
  std::string name = "tableau";
  std::string text;  ///< what it is good for, one line
  std::string cite;
  MatX A;                              ///< s × s
  VecX b;                              ///< s
  std::optional<VecX> c;               ///< s; row sums of A if absent
  std::optional<VecX> bhat;            ///< s, the weights of the embedded method
  std::optional<VecX> bhat2;           ///< a second, cruder embedded method (dop853)
  double error_scale = 1;              ///< a step is taken to err by this many times what b - bhat says
  std::optional<int> order, embedded;  ///< claims, checked
  std::optional<DenseData> dense;
  /// The claims were proved before: they are believed. Proving those of a method of order 8 takes longer than
  /// most integrations; the tests of the library call proved().
  bool proved = false;
};

class Tableau {
 public:
  /// Throws Error naming the tableau and the row: sizes, entries that are no numbers, Σⱼ aᵢⱼ ≠ cᵢ, Σ bᵢ ≠ 1,
  /// an order claimed that the order conditions do not give.
  explicit Tableau(TableauData data);
  /// The same with coefficients known to more digits than `data` holds (nodes of high collocation methods).
  Tableau(TableauData data, Coefficients coefficients);

  const std::string& name() const { return data_.name; }
  const TableauData& data() const { return data_; }  ///< exact entries; c is always there
  int stages() const { return static_cast<int>(b_.size()); }
  const Mat& A() const { return A_; }
  const Vec& b() const { return b_; }
  const Vec& c() const { return c_; }
  const std::optional<Vec>& bhat() const { return bhat_; }
  const std::optional<Vec>& bhat2() const { return bhat2_; }
  /// b + error_scale (bhat - b): the weights a step is compared with to choose its length.
  const std::optional<Vec>& compared() const { return compared_; }
  /// The interpolant given with the coefficients; if there is none, the collocation polynomial of a
  /// collocation method (order s); else nothing.
  const std::optional<DenseOutput>& dense() const { return dense_; }
  const Coefficients& coefficients() const { return coefficients_; }

  int order() const { return order_; }
  /// The same tableau with all its claims proved. Throws Error naming one that does not hold.
  Tableau proved() const;
  /// The order with bhat in place of b. Requires that there is one.
  int embedded_order() const;
  int stage_order() const { return integrate::stage_order(coefficients_); }

  bool is_explicit() const;  ///< strictly lower triangular: one stage after another, nothing to solve
  bool is_diagonally_implicit() const;  ///< lower triangular with a nonzero diagonal: stage by stage
  /// The same diagonal entry in all implicit stages: one factorisation serves them all.
  bool is_singly_diagonally_implicit() const;
  bool is_implicit() const { return !is_explicit(); }
  /// c₁ = 0 and a first row of zeros: the first stage is x′ at the mesh point.
  bool starts_explicit() const;
  /// The last row of A is b and cₛ = 1: the last stage is the new point.
  bool is_stiffly_accurate() const;
  /// Both of the above, explicit: the last stage is the first of the next step.
  bool is_fsal() const { return starts_explicit() && is_stiffly_accurate(); }
  bool is_collocation() const { return satisfies_collocation(coefficients_); }
  bool is_symplectic()
      const;  ///< bᵢaᵢⱼ + bⱼaⱼᵢ = bᵢbⱼ: keeps quadratic invariants (Geometric Integration, §IV.2)
  bool is_symmetric() const;  ///< a step of -Δt undoes a step of Δt (§V.2)

  /// A property by its name: "explicit", "stiffly accurate", …. Throws Error listing the names.
  bool is(const std::string& property) const;
  static const std::vector<std::string>& properties();

  std::string str() const;    ///< drawn, over several lines
  std::string latex() const;  ///< an array environment

 private:
  void check_sizes() const;
  void evaluate_entries();
  void check_sums() const;
  void check_claims();
  void check_dense();
  void derive_dense();
  void round();
  std::string subject() const { return "tableau '" + data_.name + "'"; }

  TableauData data_;
  Coefficients coefficients_;
  Mat A_;
  Vec b_, c_;
  std::optional<Vec> bhat_, bhat2_, compared_;
  std::optional<DenseOutput> dense_;
  int order_ = 0;
};

using TableauPtr = std::shared_ptr<const Tableau>;

}  // namespace pendula::integrate
