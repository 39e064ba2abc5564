#include "integrate/step/spectrum.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <vector>

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

  /// False where the product cannot be evaluated or is not finite.
  template <class In, class Out>
  bool operator()(const In& v, Out&& product) {
    constexpr double step = 1e-7;  // relative, above √ε: rounding of x′ divided by it stays below 10⁻⁸
    x_ = at_.x + step * scale_.cwiseProduct(v);
    xdot_ = at_.xdot;
    z_ = at_.z;
    if (!derivative_(at_.t, x_.data(), xdot_.data(), z_.data())) return false;
    product = (xdot_ - at_.xdot).cwiseQuotient(scale_) / step;
    return product.allFinite();
  }

 private:
  RhsSolver& derivative_;
  const Point& at_;
  Vec scale_, x_, xdot_, z_;
};

std::optional<Mat> columns(ScaledJacobian& J, Eigen::Index n) {
  Mat all(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    if (!J(Vec::Unit(n, j), all.col(j))) return {};
  return all;
}

/// The Hessenberg matrix VᵀJV of a Krylov space.
std::optional<Mat> hessenberg(ScaledJacobian& J, Eigen::Index n) {
  Mat V(n, most + 1), H = Mat::Zero(most + 1, most);
  for (Eigen::Index i = 0; i < n; ++i) V(i, 0) = 1 + 0.5 * std::cos(1.7 * static_cast<double>(i));
  V.col(0).normalize();
  Vec w(n);
  for (Eigen::Index k = 0; k < most; ++k) {
    if (!J(V.col(k), w)) return {};
    const double size = w.norm();
    for (int twice = 0; twice < 2; ++twice) {
      const Vec part = V.leftCols(k + 1).transpose() * w;
      w -= V.leftCols(k + 1) * part;
      H.col(k).head(k + 1) += part;
    }
    const double left = w.norm();
    constexpr double rounding = 1e-8;  // relative to the differences
    if (left <= rounding * size || k + 1 == most) return Mat(H.topLeftCorner(k + 1, k + 1));
    H(k + 1, k) = left;
    V.col(k + 1) = w / left;
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

/// Calls take(Re λ, Im λ) for the eigenvalues of A. Where the other entries of a row or a column are 0, its
/// diagonal is one, and the rest has the others (Parlett & Reinsch, ibid.): matrices of chains of reactions
/// need no iteration. False where that fails.
template <class Take>
bool eigenvalues(const Mat& A, Take take) {
  std::vector<Eigen::Index> rest(static_cast<std::size_t>(A.rows()));
  std::iota(rest.begin(), rest.end(), Eigen::Index{0});
  const auto is_alone = [&](Eigen::Index i) {
    const auto is_zero = [&](bool in_row) {
      return std::all_of(rest.begin(), rest.end(),
                         [&](Eigen::Index j) { return j == i || (in_row ? A(i, j) : A(j, i)) == 0; });
    };
    return is_zero(true) || is_zero(false);
  };
  for (auto i = std::find_if(rest.begin(), rest.end(), is_alone); i != rest.end();
       i = std::find_if(rest.begin(), rest.end(), is_alone)) {
    take(A(*i, *i), 0.0);
    rest.erase(i);
  }
  if (rest.empty()) return true;
  if (rest.size() == 2) {
    const double a = A(rest[0], rest[0]), d = A(rest[1], rest[1]);
    const double product = A(rest[0], rest[1]) * A(rest[1], rest[0]);
    const double mean = (a + d) / 2, square = (a - d) / 2 * ((a - d) / 2) + product;
    if (!std::isfinite(square)) return false;
    const double root = std::sqrt(std::fabs(square));
    take(square < 0 ? mean : mean + root, square < 0 ? root : 0.0);
    take(square < 0 ? mean : mean - root, square < 0 ? -root : 0.0);
    return true;
  }
  const Eigen::EigenSolver<Mat> solver(A(rest, rest), false);
  if (solver.info() != Eigen::Success) return false;
  for (const std::complex<double> lambda : solver.eigenvalues()) take(lambda.real(), lambda.imag());
  return true;
}

}  // namespace

std::optional<Rates> rates(RhsSolver& derivative, const Point& at, double harmless) {
  const Eigen::Index n = at.x.size();
  ScaledJacobian J(derivative, at);
  auto matrix = n <= most ? columns(J, n) : hessenberg(J, n);
  if (!matrix) return {};
  balance(*matrix);
  const double norm =
      std::min(matrix->cwiseAbs().rowwise().sum().maxCoeff(), matrix->cwiseAbs().colwise().sum().maxCoeff());
  if (norm < harmless) return Rates{norm, norm, norm};
  Rates found;
  const bool converged = eigenvalues(*matrix, [&found](double re, double im) {
    const double size = std::hypot(re, im);
    found.fastest = std::max(found.fastest, size);
    found.growing = std::max(found.growing, re);
    if (re < -0.5 * size) found.damped = std::max(found.damped, -re);
  });
  if (!converged) return {};
  return found;
}

std::optional<double> SpectralRadius::at(RhsSolver& derivative, const Point& at) {
  constexpr double fresh = 0.1;  // share of the start vector, enough for a mode to grow in two steps
  const Eigen::Index n = at.x.size();
  const bool begins = direction_.size() != n;
  if (begins) {
    any_ = Vec::NullaryExpr(n, [](Eigen::Index i) { return 1 + 0.5 * std::cos(1.7 * i); }).normalized();
    direction_ = any_;
  }
  // the last direction may be a decoupled mode that has become slow
  direction_ += fresh * any_;
  ScaledJacobian J(derivative, at);
  double radius = 0;
  for (int k = 0; k < (begins ? 4 : 2); ++k) {
    direction_.normalize();
    if (!J(direction_, ahead_)) return {};
    radius = ahead_.norm();
    if (!(radius > 0)) break;
    direction_.swap(ahead_);
  }
  direction_.normalize();
  return radius;
}

}  // namespace pendula::integrate
