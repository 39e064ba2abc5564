#include "integrate/step/spectrum.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace pendula::integrate {
namespace {

constexpr Eigen::Index most = 12;  // dimension of a Krylov space; of smaller models all eigenvalues

/// v ↦ D⁻¹ (∂x′/∂x) D v with D the sizes of the states, which makes the map independent of units.
class ScaledJacobian {
 public:
  ScaledJacobian(RhsSolver& derivative, const Point& at)
      : derivative_(derivative), at_(at), scale_(at.x.cwiseAbs()) {
    const double largest = scale_.maxCoeff();
    scale_.array() += largest > 0 ? 1e-3 * largest : 1;
  }

  std::optional<Vec> operator()(const Vec& v) const {
    constexpr double step = 1e-7;  // relative, above √ε: rounding of x′ divided by it stays below 10⁻⁸
    const Vec x = at_.x + step * scale_.cwiseProduct(v);
    Vec xdot = at_.xdot, z = at_.z;
    if (!derivative_(at_.t, x.data(), xdot.data(), z.data())) return {};
    Vec product = (xdot - at_.xdot).cwiseQuotient(scale_) / step;
    if (!product.allFinite()) return {};
    return product;
  }

 private:
  RhsSolver& derivative_;
  const Point& at_;
  Vec scale_;
};

std::optional<Mat> columns(const ScaledJacobian& J, Eigen::Index n) {
  Mat all(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto column = J(Vec::Unit(n, j));
    if (!column) return {};
    all.col(j) = *column;
  }
  return all;
}

/// The Hessenberg matrix VᵀJV of a Krylov space.
std::optional<Mat> hessenberg(const ScaledJacobian& J, Eigen::Index n) {
  Mat V(n, most + 1), H = Mat::Zero(most + 1, most);
  for (Eigen::Index i = 0; i < n; ++i) V(i, 0) = 1 + 0.5 * std::cos(1.7 * static_cast<double>(i));
  V.col(0).normalize();
  for (Eigen::Index k = 0; k < most; ++k) {
    auto w = J(V.col(k));
    if (!w) return {};
    const double size = w->norm();
    for (int twice = 0; twice < 2; ++twice) {
      const Vec part = V.leftCols(k + 1).transpose() * *w;
      *w -= V.leftCols(k + 1) * part;
      H.col(k).head(k + 1) += part;
    }
    const double left = w->norm();
    constexpr double rounding = 1e-8;  // relative to the differences
    if (left <= rounding * size || k + 1 == most) return Mat(H.topLeftCorner(k + 1, k + 1));
    H(k + 1, k) = left;
    V.col(k + 1) = *w / left;
  }
  return {};
}

/// Balances A by D⁻¹ A D with powers of two to rows and columns of equal norm; otherwise eigenvalues far
/// below ‖A‖ are lost (Parlett & Reinsch, Numer. Math. 13, 1969; 0.95 is theirs).
void balance(Mat& A) {
  bool changed = true;
  for (int sweep = 0; changed && sweep < 20; ++sweep) {
    changed = false;
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      const double diagonal = std::fabs(A(i, i));
      const double column = A.col(i).lpNorm<1>() - diagonal, row = A.row(i).lpNorm<1>() - diagonal;
      if (!(column > 0 && row > 0)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (!(column * factor + row / factor < 0.95 * (column + row))) continue;
      A.col(i) *= factor;
      A.row(i) /= factor;
      changed = true;
    }
  }
}

}  // namespace

std::optional<Rates> rates(RhsSolver& derivative, const Point& at, double harmless) {
  const Eigen::Index n = at.x.size();
  const ScaledJacobian J(derivative, at);
  auto matrix = n <= most ? columns(J, n) : hessenberg(J, n);
  if (!matrix) return {};
  balance(*matrix);
  const double norm =
      std::min(matrix->cwiseAbs().rowwise().sum().maxCoeff(), matrix->cwiseAbs().colwise().sum().maxCoeff());
  if (norm < harmless) return Rates{norm, norm, norm};
  const Eigen::EigenSolver<Mat> solver(*matrix, false);
  if (solver.info() != Eigen::Success) return {};
  Rates found;
  for (const std::complex<double> lambda : solver.eigenvalues()) {
    const double size = std::abs(lambda);
    found.fastest = std::max(found.fastest, size);
    found.growing = std::max(found.growing, lambda.real());
    if (lambda.real() < -0.5 * size) found.damped = std::max(found.damped, -lambda.real());
  }
  return found;
}

std::optional<double> SpectralRadius::at(RhsSolver& derivative, const Point& at) {
  constexpr double fresh = 0.1;  // share of the start vector, enough for a mode to grow in two steps
  const Eigen::Index n = at.x.size();
  const Vec any =
      Vec::NullaryExpr(n, [](Eigen::Index i) { return 1 + 0.5 * std::cos(1.7 * i); }).normalized();
  const bool begins = direction_.size() != n;
  if (begins) direction_ = any;
  // the last direction may be a decoupled mode that has become slow
  direction_ += fresh * any;
  const ScaledJacobian J(derivative, at);
  double radius = 0;
  for (int k = 0; k < (begins ? 4 : 2); ++k) {
    direction_.normalize();
    const auto ahead = J(direction_);
    if (!ahead) return {};
    radius = ahead->norm();
    if (!(radius > 0)) break;
    direction_ = *ahead;
  }
  direction_.normalize();
  return radius;
}

}  // namespace pendula::integrate
