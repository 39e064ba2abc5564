#include "sysid/regression/least_squares.hpp"

#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/graph.hpp"

namespace pendula::sysid {
namespace {

constexpr double no_entry = 1e-8;  // of null vectors, about √ε: they err by ε times a condition number
constexpr double whole_within = 1e-6;  // a quotient of such entries that is shown as a whole number

/// Reduced echelon form of the columns; free directions become unit vectors if possible.
Mat echelon(Mat n) {
  Index column = 0;
  for (Index pass = 0; pass < n.rows() && column < n.cols(); ++pass) {
    Index row = 0, pivot = 0;
    n.rightCols(n.cols() - column).cwiseAbs().maxCoeff(&row, &pivot);
    pivot += column;
    if (std::abs(n(row, pivot)) < no_entry) break;
    n.col(pivot).swap(n.col(column));
    n.col(column) /= n(row, column);
    for (Index j = 0; j < n.cols(); ++j)
      if (j != column) n.col(j) -= n(row, j) * n.col(column).eval();
    ++column;
  }
  for (Index j = 0; j < n.cols(); ++j) {
    const double largest = n.col(j).cwiseAbs().maxCoeff();
    for (Index i = 0; i < n.rows(); ++i)
      if (std::abs(n(i, j)) < no_entry * largest) n(i, j) = 0;
  }
  return n;
}

std::string coefficient(double value) {
  const double whole = std::round(value);
  return std::abs(value - whole) < whole_within * std::max(1.0, std::abs(value)) ? rounded(whole, 10)
                                                                                 : rounded(value, 4);
}

/// "2 a1 + b0" from coefficients.
std::string combination(const std::vector<double>& c, const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < c.size(); ++i) {
    if (c[i] == 0) continue;
    const std::string size = coefficient(std::abs(c[i]));
    out += out.empty() ? (c[i] < 0 ? "-" : "") : (c[i] < 0 ? " - " : " + ");
    out += (size == "1" ? "" : size + " ") + names[i];
  }
  return out;
}

/// An equivalent column with small integer entries, if there is one.
std::vector<double> presentable(const Eigen::Ref<const Vec>& n) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const double v : n)
    if (v != 0) smallest = std::min(smallest, std::abs(v));
  std::vector<double> best(n.begin(), n.end());
  constexpr int largest = 12;  // 1/2, 1/3, 1/4, 1/6 and their multiples; larger ones are no easier to read
  for (int denominator = 1; denominator <= largest; ++denominator) {
    bool whole = true;
    std::vector<double> scaled;
    for (const double v : n) {
      const double s = v / smallest * denominator;
      const double rest = std::abs(s - std::round(s));
      scaled.push_back(rest < whole_within * std::max(1.0, std::abs(s)) ? std::round(s) : s);
      whole = whole && scaled.back() == std::round(scaled.back());
    }
    if (denominator == 1 || whole) best = scaled;
    if (whole) break;
  }
  for (const double v : best)  // makes the first entry positive
    if (v != 0) {
      if (v < 0)
        for (double& w : best) w = w == 0 ? 0 : -w;
      break;
    }
  return best;
}

void require_finite(const Mat& m, const std::string& what) {
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j)
      if (!std::isfinite(m(i, j)))
        throw Error(text(what, " has ", std::isnan(m(i, j)) ? "nan" : "an infinite value", " in row ", i + 1,
                         "; leave that row out"));
}

/// [A y] with weighted rows, so that the errors are white.
Mat whitened(const Mat& A, const Vec& y, const Weighting& w) {
  Mat both(A.rows(), A.cols() + 1);
  both << A, y;
  if (w.weights.size() > 0) {
    if (w.weights.size() != y.size())
      throw Error(text("weights: expected ", y.size(), " numbers, one per row of A, got ", w.weights.size()));
    for (Index i = 0; i < w.weights.size(); ++i)
      if (!(w.weights[i] >= 0) || !std::isfinite(w.weights[i]))
        throw Error(
            text("weights: entry ", i + 1, " is ", shortest(w.weights[i]), "; weights are not negative"));
    return w.weights.cwiseSqrt().asDiagonal() * both;
  }
  if (w.covariance.size() == 0) return both;
  if (w.covariance.rows() != y.size() || (w.covariance.cols() != 1 && w.covariance.cols() != y.size()))
    throw Error(text("covariance: expected a ", y.size(), "×", y.size(), " matrix or its diagonal, got ",
                     w.covariance.rows(), "×", w.covariance.cols()));
  require_finite(w.covariance, "covariance");
  if (w.covariance.cols() == 1 && y.size() != 1) {
    if (!(w.covariance.minCoeff() > 0)) throw Error("covariance: the variances must be positive");
    return w.covariance.col(0).cwiseSqrt().cwiseInverse().asDiagonal() * both;
  }
  const double size = w.covariance.cwiseAbs().maxCoeff();
  constexpr double rounding = 1e-10;  // matrices may be printed with ten digits
  if ((w.covariance - w.covariance.transpose()).cwiseAbs().maxCoeff() > rounding * size)
    throw Error("covariance: the matrix is not symmetric");
  const Eigen::LLT<Mat> llt(w.covariance);
  if (llt.info() != Eigen::Success || llt.rcond() < eps)
    throw Error("covariance: the matrix is not positive definite");
  return llt.matrixL().solve(both);
}

}  // namespace

bool LeastSquares::exact() const {
  // ‖y - Φθ‖ by Householder QR errs by a modest multiple of ε (‖y‖ + ‖Φ‖ ‖θ‖) (Higham 2002, §20.3)
  return std::sqrt(sse) <= 100 * eps * (y_norm + theta.cwiseAbs().dot(scale));
}

bool LeastSquares::identifiable(Index i) const {
  return null_space.cols() == 0 || null_space.row(i).cwiseAbs().maxCoeff() == 0;
}

LeastSquares solve_triangular(const Mat& R, Index rows, double accuracy) {
  const Index d = R.cols() - 1;
  LeastSquares out;
  out.rows = rows;
  const Mat U = R.topLeftCorner(d, d);
  const Vec z = R.col(d).head(d);
  out.scale = U.colwise().norm();
  out.y_norm = R.col(d).norm();
  Vec scaling = out.scale;
  for (double& s : scaling)
    if (s == 0) s = 1;
  if (d == 0) {
    out.sse = out.y_norm * out.y_norm;
    out.null_space.resize(0, 0);
    return out;
  }
  const Eigen::JacobiSVD<Mat> svd(U * scaling.cwiseInverse().asDiagonal(),
                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec s = svd.singularValues();
  const double tolerance = std::max(static_cast<double>(std::max(rows, d)) * eps, accuracy) * s[0];
  while (out.rank < d && s[out.rank] > tolerance) ++out.rank;
  const Index r = out.rank;
  const Mat V =
      scaling.cwiseInverse().asDiagonal() * svd.matrixV().leftCols(r) * s.head(r).cwiseInverse().asDiagonal();
  out.theta = V * (svd.matrixU().leftCols(r).transpose() * z);
  Mat P = V * V.transpose();
  out.null_space.resize(d, d - r);
  if (r < d) {  // minimum norm in the units of θ: removes the component in the null space
    const Mat N = scaling.cwiseInverse().asDiagonal() * svd.matrixV().rightCols(d - r);
    const Mat Q = thin_q(Eigen::HouseholderQR<Mat>(N).householderQ(), d - r);
    const Mat keep = Mat::Identity(d, d) - Q * Q.transpose();
    out.theta = keep * out.theta;
    P = keep * P * keep;
    out.null_space = echelon(Q);
    for (Index i = 0; i < d; ++i)  // rounding of the projection
      if (std::abs(out.theta[i]) < 10 * eps * out.theta.cwiseAbs().maxCoeff()) out.theta[i] = 0;
  }
  out.inverse = 0.5 * (P + P.transpose());
  out.sse = (U * out.theta - z).squaredNorm() + R(d, d) * R(d, d);
  return out;
}

WeightedLeastSquares least_squares(const Mat& A, const Vec& y, const Weighting& weighting) {
  if (A.rows() != y.size())
    throw Error(text("A has ", counted(A.rows(), "row"), " but y has ", counted(y.size(), "entry")));
  if (A.rows() == 0 || A.cols() == 0) throw Error("A is empty: there is nothing to estimate");
  require_finite(A, "A");
  require_finite(y, "y");
  const Mat both = whitened(A, y, weighting);
  TriangularFactor factor(both.cols());
  const Index block = std::max(TriangularFactor::block_rows, both.cols());
  for (Index i = 0; i < both.rows(); i += block)
    factor.add(both.middleRows(i, std::min(block, both.rows() - i)));
  WeightedLeastSquares out;
  static_cast<LeastSquares&>(out) = solve_triangular(factor.R(), both.rows());
  out.residuals = y - A * out.theta;
  const Index free = out.rows - out.rank;
  out.sigma2 = free > 0 && !out.exact() ? out.sse / static_cast<double>(free) : 0;
  out.known_noise = weighting.covariance.size() > 0;
  out.covariance = out.known_noise ? out.inverse : Mat(out.sigma2 * out.inverse);
  return out;
}

std::vector<std::string> free_directions(const Mat& n, const std::vector<std::string>& names,
                                         InParameters predictions) {
  const bool linear = predictions == InParameters::linear;
  std::vector<std::string> out;
  for (Index j = 0; j < n.cols(); ++j) {
    const std::vector<double> c = presentable(n.col(j));
    std::vector<std::string> who, steps;
    for (std::size_t i = 0; i < c.size(); ++i)
      if (c[i] != 0) {
        who.push_back(names[i]);
        steps.push_back(coefficient(c[i]));
      }
    if (who.size() == 1) {
      out.push_back(who[0] + " is not identifiable");
      continue;
    }
    std::string line =
        text("(", join(who, ", "), ") + α (", join(steps, ", "),
             linear ? ") predicts the same for every α" : ") predicts the same to first order in α");
    bool alone = who.size() == 2;  // one direction in two parameters leaves one combination determined
    for (Index k = 0; k < n.cols(); ++k)
      for (std::size_t i = 0; i < c.size(); ++i)
        alone = alone && (k == j || c[i] == 0 || n(static_cast<Index>(i), k) == 0);
    if (alone) {
      std::vector<double> kept(c.size(), 0);
      std::size_t first = 0;
      while (c[first] == 0) ++first;
      std::size_t second = first + 1;
      while (c[second] == 0) ++second;
      kept[first] = c[second];
      kept[second] = -c[first];
      line =
          text(linear ? "only " : "at the estimate only ",
               combination(presentable(Eigen::Map<Vec>(kept.data(), static_cast<Index>(kept.size()))), names),
               " is determined: ", line);
    }
    out.push_back(line);
  }
  return out;
}

Vec standard_deviations(const LeastSquares& ls, const Mat& covariance) {
  Vec std(ls.theta.size());
  for (Index i = 0; i < std.size(); ++i)
    std[i] = ls.identifiable(i) ? std::sqrt(std::max(0.0, covariance(i, i)))
                                : std::numeric_limits<double>::infinity();
  return std;
}

}  // namespace pendula::sysid
