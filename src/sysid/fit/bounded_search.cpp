#include "sysid/fit/bounded_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "base/triangular_factor.hpp"
#include "sysid/regression/least_squares.hpp"

namespace pendula::sysid {

Vec Bounds::nearest(const Vec& theta) const {
  return any() ? Vec(theta.cwiseMax(lower).cwiseMin(upper)) : theta;
}

std::vector<Index> Bounds::hold(const Vec& theta, Mat& J, const Vec& r) const {
  std::vector<Index> active;
  if (!any()) return active;
  const Vec gradient = J.transpose() * r;
  for (Index i = 0; i < theta.size(); ++i) {
    const bool below = theta[i] <= lower[i] && gradient[i] > 0,
               above = theta[i] >= upper[i] && gradient[i] < 0;
    if (!below && !above) continue;
    J.col(i).setZero();
    active.push_back(i);
  }
  return active;
}

Mat difference_jacobian(const Residuals& r, const Vec& theta, const Vec& scale, const Bounds& bounds) {
  const double root = std::cbrt(eps);  // truncation h²|r‴|/6 and rounding ε|r|/h are least for h ~ ε^⅓
  Mat J;
  for (Index i = 0; i < theta.size(); ++i) {
    poll_interrupt();
    const double h = root * std::max(std::abs(theta[i]), scale[i]);
    Vec ahead = theta;
    Vec behind = theta;
    ahead[i] += h;
    behind[i] -= h;
    ahead = bounds.nearest(ahead);
    behind = bounds.nearest(behind);
    const double width = ahead[i] - behind[i];
    const Vec slope = width > 0 ? Vec((r(ahead) - r(behind)) / width) : Vec(Vec::Zero(r(theta).size()));
    if (J.size() == 0) J.resize(slope.size(), theta.size());
    J.col(i) = slope;
  }
  return J;
}

namespace {

void check(const Vec& start, const Bounds& bounds, const Vec& scale) {
  const auto size = [&](const Vec& v, const char* what) {
    if (v.size() != start.size())
      throw Error(
          text(what, " has ", counted(v.size(), "number"), " for ", counted(start.size(), "parameter")));
  };
  if (start.size() == 0) throw Error("start has no numbers: nothing can be varied");
  size(scale, "scale");
  if (!bounds.any()) return;
  size(bounds.lower, "lower");
  size(bounds.upper, "upper");
  for (Index i = 0; i < start.size(); ++i)
    if (!(bounds.lower[i] <= bounds.upper[i]))
      throw Error(text("the bounds of parameter ", i + 1, " are not an interval: ",
                       rounded(bounds.lower[i], 6), " … ", rounded(bounds.upper[i], 6)));
}

}  // namespace

BoundedMinimum least_squares_within(const Residuals& r, const Vec& given, const Bounds& bounds,
                                    const Vec& sizes, int iterations, double accuracy) {
  const Vec scale = sizes.size() > 0 ? sizes : Vec(Vec::Ones(given.size()));
  check(given, bounds, scale);
  const Vec start = bounds.nearest(given);
  const Vec first = r(start);
  if (!first.allFinite()) throw Failure("the residuals are not finite at the start");
  BoundedMinimum out;
  const auto loss = [&](Vec& theta) -> std::optional<QuadraticModel> {
    theta = bounds.nearest(theta);
    try {
      const Vec e = r(theta);
      if (!e.allFinite()) return {};
      Mat J = difference_jacobian(r, theta, scale, bounds);
      if (!J.allFinite()) return {};
      bounds.hold(theta, J, e);
      return gauss_newton_model(J, e);
    } catch (const UserFacing&) {
      return {};
    }
  };
  MinimiserOptions options;
  options.iterations = iterations;
  options.noise = difference_noise;
  options.accuracy = accuracy;
  Vec begin = start;
  std::optional<QuadraticModel> model = loss(begin);
  if (!model)
    throw Failure(
        "the residuals cannot be differentiated at the start: next to it they are not finite; start elsewhere");
  const auto from_there = [&](Vec& theta) {  // avoids a second evaluation at the start
    std::optional<QuadraticModel> here;
    here.swap(model);
    return here ? here : loss(theta);
  };
  out.search = minimise(from_there, begin, options);
  out.residuals = r(out.search.theta);
  out.J = difference_jacobian(r, out.search.theta, scale, bounds);
  Mat J = out.J;
  out.active = bounds.hold(out.search.theta, J, out.residuals);
  return out;
}

SearchCovariance covariance_of(const BoundedMinimum& m) {
  const Index n = m.J.cols();
  std::vector<Index> free;
  for (Index i = 0; i < n; ++i)
    if (std::find(m.active.begin(), m.active.end(), i) == m.active.end()) free.push_back(i);
  SearchCovariance out;
  out.covariance = Mat::Zero(n, n);
  const LeastSquares ls = solve_triangular(pendula::triangular_factor(m.J(Eigen::all, free), m.residuals).R(),
                                           m.J.rows(), difference_accuracy);
  out.rank = ls.rank;
  const Index left = m.J.rows() - ls.rank;
  out.sigma2 = left > 0 ? m.residuals.squaredNorm() / static_cast<double>(left) : 0;
  out.covariance(free, free) = out.sigma2 * ls.inverse;
  for (Index k = 0; k < static_cast<Index>(free.size()); ++k)
    if (!ls.identifiable(k)) out.covariance(free[k], free[k]) = std::numeric_limits<double>::infinity();
  return out;
}

}  // namespace pendula::sysid
