// nearest = true: moves fixed values that contradict the equations onto them, as little as possible.
//
//   min ½ Σ_k ((w_k - fix_k)/s_k)²   subject to   0 = r(w)
//
// First a point on the equations, with the fixes as guesses. Then Newton's method on the Lagrangian with
// exact second derivatives (Nocedal & Wright, Numerical Optimization, 2nd ed., §18.1), a minimal correction
// back onto the equations after every step, and steps shortened until the distance does not grow.
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/newton/sparse_solution.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

using Index = Eigen::Index;

class Nearest {
 public:
  explicit Nearest(const StartSystem& s) : s_(s), n_(static_cast<Index>(s.unknowns.size())) {
    equations_.rows.assign(s.rows.size(), 1);
    for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) equations_.rows[i] = 0;
    weight_ = Vec::Zero(n_);
    target_ = Vec::Zero(n_);
    for (std::size_t k = 0; k < s.fixes(); ++k)
      if (const auto j = s.fixed_unknown(k)) {
        weight_[*j] = 1;
        target_[*j] = s.request.fix[k].second;
      }
    prepare_hessian();
  }

  StartSolution run() {
    StartSolution at = solve_start(s_, equations_);
    StartSolution beside = beside_fixes(at.w);
    if (beside.solved && !(at.solved && distance(at.w) <= distance(beside.w))) at = std::move(beside);
    if (!at.solved) return at;
    for (int k = 0; k < most_steps; ++k) {
      poll_interrupt();
      const auto [newton, gauss] = steps(at.w);
      const double far = 1 + at.w.cwiseQuotient(s_.unit).norm();
      const auto goes_on = [&](const Vec& step) {
        const double size = step.norm();
        return std::isfinite(size) && size > rounding * far && move(at, step);
      };
      if (!goes_on(newton) && !goes_on(gauss)) break;
    }
    // the equations hold; the fixes have moved by the remaining distance
    return at;
  }

 private:
  static constexpr int most_steps = 100;
  static constexpr double rounding = 1e-14;  ///< 45 ε

  double distance(const Vec& w) const {
    return weight_.cwiseProduct((w - target_).cwiseQuotient(s_.unit)).norm();
  }

  /// Starts from the fixes and first solves for the free unknowns alone. A minimal step of all unknowns
  /// would change coordinates by a percent to avoid an acceleration of 10⁷ in a unit that the equations
  /// do not determine.
  StartSolution beside_fixes(Vec w) const {
    constexpr int few = 5;  // steps of Newton's method from a good start: 2⁵ times the digits
    for (Index j = 0; j < w.size(); ++j)
      if (weight_[j] != 0) w[j] = target_[j];
    if (w.size() != n_ || !w.allFinite()) return {};
    for (int k = 0; k < few; ++k) {
      Mat J = Mat(s_.jacobian(w)).topRows(static_cast<Index>(s_.first_fix));
      if (!J.allFinite()) return {};
      for (Index j = 0; j < n_; ++j)
        if (weight_[j] != 0) J.col(j).setZero();
      const auto [row, column] = scales(J);
      const Vec right = row.cwiseProduct(s_.residual(w).head(J.rows()));
      const Vec step = Eigen::CompleteOrthogonalDecomposition<Mat>(J).solve(right);
      if (!step.allFinite()) return {};
      w -= column.cwiseProduct(step).cwiseProduct(s_.unit);
    }
    return gauss_newton(s_, w, equations_);
  }

  bool move(StartSolution& at, const Vec& step) {
    constexpr double shortest = 1e-6;  // the tests of starts pass from a tenth to ten times this
    for (double alpha = 1; alpha > shortest; alpha /= 2) {
      StartSolution next = gauss_newton(s_, at.w + alpha * step.cwiseProduct(s_.unit), equations_);
      if (!next.solved || distance(next.w) > distance(at.w) * (1 + rounding)) continue;
      constexpr double still = 1e-15;  // 4.5 ε
      const bool moved = (next.w - at.w).cwiseQuotient(s_.unit).norm() > still;
      at = std::move(next);
      return moved;
    }
    return false;
  }

  /// ∂²(Σ λ_i r_i)/∂w² with multipliers as symbols of their own.
  void prepare_hessian() {
    Expr lagrangian;
    for (std::size_t i = 0; i < s_.first_fix; ++i) {
      multipliers_.push_back(symbol(Kind::slot, text("nearest_multiplier_", i)));
      lagrangian += multipliers_.back() * s_.rows[i];
    }
    hessian_ = sparse_jacobian(gradient(lagrangian, s_.unknowns), s_.unknowns);
    for (const Entry& e : hessian_) second_.push_back(e.value);
  }

  Mat hessian(const Vec& w, const Vec& lambda) const {
    auto point = s_.point(w);
    for (std::size_t i = 0; i < multipliers_.size(); ++i) point[multipliers_[i]] = lambda[i] / s_.row_unit[i];
    const auto values = pendula::evaluate(second_, point);
    Mat H = Mat::Zero(n_, n_);
    for (std::size_t k = 0; k < values.size(); ++k)
      H(hessian_[k].row, hessian_[k].column) =
          values[k] * s_.unit[hessian_[k].row] * s_.unit[hessian_[k].column];
    return H;
  }

  /// Scales the rows of J to length 1, and so the columns of free unknowns: accelerations in nanometres have
  /// units of 10⁻⁹ … 10⁹ if only their own equations determine them. Returns the factors of rows and columns.
  std::pair<Vec, Vec> scales(Mat& J) const {
    Vec row = Vec::Ones(J.rows()), column = Vec::Ones(n_);
    const auto inverse = [](double length) { return length > 0 ? 1 / length : 1.0; };
    for (int sweep = 0; sweep < 3; ++sweep) {
      for (Index i = 0; i < J.rows(); ++i) {
        const double factor = inverse(J.row(i).norm());
        J.row(i) *= factor;
        row[i] *= factor;
      }
      for (Index j = 0; j < n_; ++j) {
        if (weight_[j] != 0) continue;
        const double factor = inverse(J.col(j).norm());
        J.col(j) *= factor;
        column[j] *= factor;
      }
    }
    return {row, column};
  }

  /// Two steps, in units, in the null space of J (the point satisfies the equations): the one that minimises
  /// the quadratic model, and the one without the curvature of the equations, which always descends, even if
  /// the other is lost in rounding errors.
  std::pair<Vec, Vec> steps(const Vec& w) const {
    Mat J = Mat(s_.jacobian(w)).topRows(static_cast<Index>(s_.first_fix));
    const std::pair<Vec, Vec> scaled = scales(J);
    const Vec &row = scaled.first, &column = scaled.second;
    const Vec g = weight_.cwiseProduct((w - target_).cwiseQuotient(s_.unit));
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(independent_row);
    qr.compute(Mat(J.transpose()));
    const Mat Z = full_q(qr.householderQ()).rightCols(n_ - qr.rank());
    if (Z.cols() == 0) return {Vec::Zero(n_), Vec::Zero(n_)};
    const Vec lambda = row.cwiseProduct(Vec(qr.solve(Vec(-g))));
    const Mat weight = weight_.asDiagonal();
    const auto least = [&](const Mat& M) -> Vec {
      const Eigen::CompleteOrthogonalDecomposition<Mat> reduced(Z.transpose() * M * Z);
      return column.cwiseProduct(Z * Vec(reduced.solve(Vec(-(Z.transpose() * g)))));
    };
    const Mat curvature = column.asDiagonal() * hessian(w, lambda) * column.asDiagonal();
    const Vec newton = least(weight + curvature), gauss = least(weight);
    return {newton.allFinite() && newton.dot(g) <= 0 ? newton : gauss, gauss};
  }

  const StartSystem& s_;
  Index n_;
  Selection equations_;
  Vec weight_, target_;
  std::vector<Expr> multipliers_, second_;
  std::vector<Entry> hessian_;
};

/// For large systems: linearised constraints without second derivatives. Exact if nothing has to
/// move, otherwise linearly convergent at a rate proportional to the moves: [W Jᵀ; J 0] [d; λ] = [-W
/// (w - fix); -r].
StartSolution sparse_nearest(const StartSystem& s) {
  // weights for undetermined unknowns, and for dependent equations
  constexpr double slight = 1e-10, redundant = 1e-12;
  constexpr int most_steps = 60;
  const auto n = static_cast<Index>(s.unknowns.size()), m = static_cast<Index>(s.first_fix);
  Selection equations;
  equations.rows.assign(s.rows.size(), 1);
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) equations.rows[i] = 0;
  Vec weight = Vec::Zero(n), target = Vec::Zero(n);
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k)) {
      weight[*j] = 1;
      target[*j] = s.request.fix[k].second;
    }
  StartSolution at = solve_start(s, equations);
  if (!at.solved) return at;
  Vec w = at.w;
  for (int k = 0; k < most_steps; ++k) {
    poll_interrupt();
    const Sparse J = s.jacobian(w);
    std::vector<Eigen::Triplet<double>> entries;
    for (Index j = 0; j < n; ++j) entries.emplace_back(j, j, weight[j] + slight);
    for (Index i = 0; i < m; ++i) entries.emplace_back(n + i, n + i, -redundant);
    for (Index j = 0; j < J.outerSize(); ++j)
      for (Sparse::InnerIterator it(J, j); it; ++it)
        if (it.row() < m) {
          entries.emplace_back(n + it.row(), j, it.value());
          entries.emplace_back(j, n + it.row(), it.value());
        }
    Sparse K(n + m, n + m);
    K.setFromTriplets(entries.begin(), entries.end());
    K.makeCompressed();
    Vec right(n + m);
    right << -weight.cwiseProduct((w - target).cwiseQuotient(s.unit)), -s.residual(w).head(m);
    const auto x = solve_by_lu(K, right);
    if (!x || !x->allFinite()) break;
    w += x->head(n).cwiseProduct(s.unit);
    constexpr double converged = 1e-10;  // gauss_newton() adds the other digits
    if (x->head(n).norm() <= converged * (1 + w.cwiseQuotient(s.unit).norm())) break;
  }
  const StartSolution near = gauss_newton(s, w, equations);
  const auto distance = [&](const Vec& v) {
    return weight.cwiseProduct((v - target).cwiseQuotient(s.unit)).norm();
  };
  constexpr double rounding = 1e-12;  // 4500 ε
  return near.solved && distance(near.w) <= distance(at.w) * (1 + rounding) ? near : at;
}

}  // namespace

StartSolution nearest_start(const StartSystem& s) {
  constexpr Index dense = 400;
  return static_cast<Index>(s.unknowns.size()) > dense ? sparse_nearest(s) : Nearest(s).run();
}

}  // namespace pendula::dae
