// Do the slopes of a step agree with the equations? A second opinion where an iteration matrix is huge.
//
// Where ∂f/∂x is huge (a Jacobian from another point, a solution that runs into a pole),
// corrections and error estimates, which are solutions with that matrix, are tiny whatever the step
// does. Two facts need no matrix:
//   - in a solved step M x′ = f at every stage, so no row of M x′ is far larger than the values f took;
//   - an estimate that the matrix has turned round (against its right side) belongs to a solution that
//     grows, and is not to be damped.
// docs/derivations.md#step-checks
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// The rows M x′ - f(t, x, z) = 0 of a model whose M is constant.
class IncrementCheck {
 public:
  /// pattern of the problem; rows with other factors of x′ than numbers and parameters are left out.
  explicit IncrementCheck(const Problem& problem);

  bool empty() const { return rows_.empty(); }
  /// A factor of x′ varies, or z follows from x′: an error of x in an iteration returns as one of z.
  bool slopes_return() const { return layout_->slopes_return; }
  /// There are rows without x′ whose Jacobian varies.
  bool has_algebraic() const { return !algebraic_.empty(); }
  void begin();
  /// A stage: x′ = unit · xdot and the residual F there, every `stride`-th number. entries: of the Jacobian.
  void add(const double* xdot, double unit, const double* F, std::ptrdiff_t stride,
           std::span<const double> entries);
  /// False where a row of M x′ is more than twice what f was at any stage and moves x by more
  /// than ten tolerances in the step. Twice: the weights of Radau and Gauss methods are
  /// positive and add up to 1, so that
  /// |M (x₁ - x₀)| ≤ h max |fᵢ|.
  bool plausible(double dt, std::span<const double> scale, std::span<const double> entries) const;

  /// Would the right side F, of a correction or an error estimate, move an unknown by more than its tolerance
  /// in the step if no matrix damped it?
  bool is_visible(double dt, const double* F, std::span<const double> scale,
                  std::span<const double> entries) const;
  /// The same of the residuals of the stages that were added.
  bool leaves_visible(double dt, std::span<const double> scale, std::span<const double> entries) const;

  /// The residual F of the first iteration, at the last stage.
  void set_first(const double* F, std::ptrdiff_t stride);
  /// Has a row without x′, whose Jacobian varies, a residual F that is neither half of its first one nor
  /// known to be harmless? An iteration with a matrix that is far too large there makes tiny
  /// corrections, although the iteration has not converged.
  bool stagnates(const double* F, std::ptrdiff_t stride) const;
  /// The same after a correction, with entries of the Jacobian at y = (x, z), from which the
  /// rounding errors of F follow. With entries of another point, where an exponential is huge,
  /// everything would count as rounding.
  bool stagnates(const double* F, const double* y, std::span<const double> entries) const;
  /// F moves no unknown visibly, by the Jacobian at y: residuals of this size are
  /// not checked in the next steps.
  void set_harmless(const double* F, const double* y, std::span<const double> entries);
  void accept();

  /// An error estimate e, the solution of (factor M + J) e = r: its norm, or that of r/factor where e points
  /// against r (cosine below -1/2), which is a sign of growth in more than a step. scale: of the unknowns.
  double undamped_norm(double norm, const double* e, double factor, std::span<const double> scale,
                       std::span<const double> entries);

 private:
  struct Term {
    int column;         ///< of x
    std::size_t entry;  ///< of the Jacobian
  };
  struct Row {
    int row;
    std::vector<Term> mass;
    std::vector<Term> other;  ///< ∂F/∂(x, z): columns of (x, z)
  };
  double scale_of(const Row& row, std::span<const double> scale, std::span<const double> entries) const;
  static double rounding_of(const Row& row, const double* y, std::span<const double> entries);
  static double least_change(const Row& row, std::span<const double> scale, std::span<const double> entries);

  struct Layout {
    std::vector<Row> rows;
    std::vector<Row> algebraic;  ///< rows without x′ whose Jacobian varies
    bool slopes_return = false;
  };
  static Layout layout_of(const Problem& problem);

  std::shared_ptr<const Layout> layout_;
  std::span<const Row> rows_, algebraic_;            ///< of the layout
  std::vector<double> slopes_, values_, residuals_;  ///< largest of |M x′|, |f| and |F| so far, row by row
  std::vector<double> first_,
      harmless_;         ///< |F| of algebraic_: of the first iteration; known by set_harmless()
  int steps_known_ = 0;  ///< for which harmless_ holds
};

}  // namespace pendula::integrate
