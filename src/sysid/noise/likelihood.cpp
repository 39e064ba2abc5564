#include "sysid/noise/likelihood.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/search/least_squares.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "sysid/noise/linear_program.hpp"

namespace pendula::sysid {
namespace {

LeastSquares ordinary(const Regression& r) {
  Weighting none;
  return least_squares(r.Phi, r.y, none);
}

LikelihoodFit gaussian(const Regression& r, const Density& f) {
  const LeastSquares ls = ordinary(r);
  const auto N = static_cast<double>(ls.rows);
  LikelihoodFit out;
  out.theta = ls.theta;
  out.scale = f.scale             ? *f.scale
              : ls.rows > ls.rank ? std::sqrt(ls.sse / static_cast<double>(ls.rows - ls.rank))
                                  : 0;
  out.covariance = out.scale * out.scale * ls.inverse;
  const double variance = f.scale ? *f.scale * *f.scale : ls.sse / N;
  out.log_likelihood = -0.5 * N * std::log(2 * std::acos(-1.0) * variance) - 0.5 * ls.sse / variance;
  return out;
}

LikelihoodFit laplace(const Regression& r, const Density& f) {
  LikelihoodFit out;
  out.theta = least_absolute(r.Phi, r.y, 1, 1);
  const double sum = (r.y - r.Phi * out.theta).lpNorm<1>();
  const auto N = static_cast<double>(r.y.size());
  out.scale = f.scale ? *f.scale : sum / N;
  out.covariance = out.scale * out.scale * ordinary(r).inverse;
  out.log_likelihood = -N * std::log(2 * out.scale) - sum / out.scale;
  return out;
}

LikelihoodFit exponential(const Regression& r, const Density& f) {
  // min Σ e = Σ y - (Σ φ)ᵀθ subject to Φθ ≤ y; columns scaled, centred at the least-squares estimate.
  const Vec scale = r.Phi.colwise().norm();
  const Vec around = ordinary(r).theta;
  const Vec rest = r.y - r.Phi * around;
  const double size = std::max(rest.cwiseAbs().maxCoeff(), least_size);
  LinearProgram lp;
  lp.G = r.Phi * scale.cwiseInverse().asDiagonal();
  lp.h = rest / size;
  lp.c = -lp.G.colwise().sum().transpose();
  const LinearSolution best = solve(lp);
  if (best.status == LinearSolution::Status::infeasible)
    throw Failure(
        "exponential noise: no θ makes all errors y - Φθ positive; for noise of "
        "both signs take laplace() or gaussian()");
  if (best.status == LinearSolution::Status::unbounded)
    throw Failure(
        "exponential noise: the likelihood has no maximum: some direction of θ lowers Σ e without end");
  LikelihoodFit out;
  out.theta = around + size * best.x.cwiseQuotient(scale);
  const double sum = (r.y - r.Phi * out.theta).sum();
  const auto N = static_cast<double>(r.y.size());
  out.scale = f.scale ? *f.scale : sum / N;
  out.log_likelihood = -N * std::log(out.scale) - sum / out.scale;
  for (const Index i : best.active) out.corner.push_back(r.sample[i]);
  std::sort(out.corner.begin(), out.corner.end());
  return out;
}

/// -ln f(e) with its first two derivatives in one compiled kernel.
class NegativeLog {
 public:
  explicit NegativeLog(const Density& f) {
    const Expr value = -log_density(f.pdf);
    const Expr slope = partial(value, f.error), curve = partial(slope, f.error);
    const Expr outputs[] = {value, slope, curve};
    kernel_ = codegen::Kernel(outputs, {&f.error, 1});
  }
  std::array<double, 3> operator()(double e) const {
    std::array<double, 3> out{};
    kernel_(&e, out.data());
    return out;
  }

 private:
  codegen::Kernel kernel_;
};

struct Objective {
  double value = 0;
  Vec gradient;
  Mat hessian;
};

Objective objective(const Regression& r, const NegativeLog& f, const Vec& theta) {
  const Vec e = r.y - r.Phi * theta;
  Objective o{0, Vec::Zero(theta.size()), Mat::Zero(theta.size(), theta.size())};
  for (Index t = 0; t < e.size(); ++t) {
    const auto [value, slope, curve] = f(e[t]);
    o.value += value;
    if (!std::isfinite(value)) return o;
    o.gradient -= slope * r.Phi.row(t).transpose();
    o.hessian += curve * r.Phi.row(t).transpose() * r.Phi.row(t);
  }
  return o;
}

[[noreturn]] void zero_density(const Regression& r, const NegativeLog& f, const Vec& theta,
                               const Density& density) {
  const Vec e = r.y - r.Phi * theta;
  for (Index t = 0; t < e.size(); ++t)
    if (!std::isfinite(f(e[t])[0]))
      throw Failure(
          text("the density ", to_text(density.pdf), " is zero or undefined at the error ", rounded(e[t], 6),
               " of sample ", r.sample[t],
               " (least-squares start); use a density that is positive everywhere, or uniform(low, high)"));
  throw Failure("the likelihood is not finite");
}

/// For densities with a kink at e = 0, such as exp(-|e|): weighted least squares with the weights slope(e)/e,
/// which never increases -ln L if that is concave in e² (Huber, Robust Statistics, 1981, §7.8); then the
/// vertex through the smallest errors, if it is better. False if there was no improvement.
bool reweight(const Regression& r, const NegativeLog& f, Vec& theta, double& value) {
  // errors below 4500 ε of y are rounding: their weights are cut there
  const double before = value, floor = 1e-12 * r.y.cwiseAbs().maxCoeff();
  // the steps converge linearly; the vertex that they approach is taken exactly below
  constexpr int most = 300;
  for (int k = 0; k < most; ++k) {
    poll_interrupt();
    const Vec e = r.y - r.Phi * theta;
    Vec w(e.size());
    for (Index t = 0; t < e.size(); ++t) {
      const double size = std::max(std::abs(e[t]), floor);
      w[t] = std::max(0.0, f(size)[1] / size);
    }
    if (!w.allFinite()) break;
    const Vec next = theta + least_squares(r.Phi, e, {w, {}}).theta;
    const double now = objective(r, f, next).value;
    if (!(now < value)) break;
    constexpr double last_bits = 1e-15;  // 4.5 ε
    const bool settled = value - now <= last_bits * std::abs(value);
    theta = next;
    value = now;
    if (settled) break;
  }
  const Vec e = r.y - r.Phi * theta;
  std::vector<Index> order(static_cast<std::size_t>(e.size()));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return std::abs(e[a]) < std::abs(e[b]); });
  order.resize(static_cast<std::size_t>(theta.size()));
  const Eigen::FullPivLU<Mat> lu(r.Phi(order, Eigen::all));
  if (lu.isInvertible()) {
    const Vec corner = lu.solve(Vec(r.y(order)));
    const double now = objective(r, f, corner).value;
    constexpr double rounding = 1e-13;  // 450 ε, of a sum over the samples: the vertex is preferred if equal
    if (now <= value + rounding * std::abs(value)) {
      theta = corner;
      value = now;
      return true;
    }
  }
  return value < before;
}

/// The estimate at a kink with covariance from the Fisher information: (mean slope² ΦᵀΦ)⁻¹.
LikelihoodFit kinked(const Regression& r, const NegativeLog& f, LikelihoodFit out, double value) {
  const Vec e = r.y - r.Phi * out.theta;
  // the slope is undefined at the kink itself; 1e-9 of y is above rounding and below any noise that matters
  const double beside = 1e-9 * r.y.cwiseAbs().maxCoeff();
  double information = 0;
  for (const double x : e)
    information +=
        std::pow(f(std::copysign(std::max(std::abs(x), beside), x))[1], 2) / static_cast<double>(e.size());
  if (information > 0) out.covariance = ordinary(r).inverse / information;
  out.log_likelihood = -value;
  return out;
}

LikelihoodFit user(const Regression& r, const Density& density) {
  const NegativeLog f(density);
  LikelihoodFit out;
  const LeastSquares ls = ordinary(r);
  out.theta = ls.theta;
  const auto negative_log_likelihood = [&](Vec& theta) -> std::optional<QuadraticModel> {
    const Objective at = objective(r, f, theta);
    if (!std::isfinite(at.value) || !at.hessian.allFinite()) return {};
    return newton_model(at.value, at.gradient, at.hessian);
  };
  if (!negative_log_likelihood(out.theta)) zero_density(r, f, out.theta, density);
  MinimiserOptions options;
  options.iterations = 500;  // a cap: densities of users may be far from quadratic
  const Minimum m = minimise(negative_log_likelihood, out.theta, options);
  out.theta = m.theta;
  out.iterations = m.iterations;
  if (m.ending == Ending::iterations) throw Failure("the likelihood did not converge in 500 Newton steps");
  double value = m.value;
  if (!m.converged()) {
    if (reweight(r, f, out.theta, value)) return kinked(r, f, std::move(out), value);
    throw Failure(
        "the likelihood cannot be increased along any direction, but its slope "
        "is not zero: is the density smooth?");
  }
  const Objective now = objective(r, f, out.theta);
  const Eigen::LLT<Mat> llt(now.hessian);
  if (llt.info() == Eigen::Success)
    out.covariance = llt.solve(Mat(Mat::Identity(out.theta.size(), out.theta.size())));
  out.log_likelihood = -now.value;
  return out;
}

}  // namespace

std::string describe(const Density& f) {
  switch (f.kind) {
    case Density::Kind::uniform:
      return text("uniform noise: density ", rounded(1 / (f.high - f.low)), " on [", rounded(f.low), ", ",
                  rounded(f.high), "]");
    case Density::Kind::gaussian:
      return f.scale ? text("Gaussian noise, σ = ", rounded(*f.scale)) : "Gaussian noise, σ estimated";
    case Density::Kind::laplace:
      return f.scale ? text("Laplace noise, b = ", rounded(*f.scale)) : "Laplace noise, b estimated";
    case Density::Kind::exponential:
      return f.scale ? text("exponential noise e ≥ 0, mean ", rounded(*f.scale))
                     : "exponential noise e ≥ 0, mean estimated";
    case Density::Kind::user:
      break;
  }
  return "noise density f(e) = " + to_text(f.pdf);
}

LikelihoodFit maximise(const Regression& r, const Density& f) {
  switch (f.kind) {
    case Density::Kind::gaussian:
      return gaussian(r, f);
    case Density::Kind::laplace:
      return laplace(r, f);
    case Density::Kind::exponential:
      return exponential(r, f);
    case Density::Kind::user:
      return user(r, f);
    case Density::Kind::uniform:
      break;
  }
  internal_error(__FILE__, __LINE__, "uniform noise has a set of estimates");
}

std::string described(const Density& f, const LikelihoodFit& fit) {
  std::string out = describe(f);
  if (!f.scale && f.kind != Density::Kind::user)
    out += text(": ",
                f.kind == Density::Kind::gaussian  ? "σ = "
                : f.kind == Density::Kind::laplace ? "b = mean |e| = "
                                                   : "mean e = ",
                rounded(fit.scale, 7));
  if (!fit.corner.empty()) {
    std::vector<std::string> samples;
    for (const Index s : fit.corner) samples.push_back(std::to_string(s));
    out += text("; e = 0 at sample", samples.size() > 1 ? "s " : " ", join(samples, ", "));
  }
  return out;
}

NegativeLogarithm negative_logarithm(const Density& f) {
  if (f.kind == Density::Kind::gaussian) return [](double e) { return std::array<double, 2>{e * e / 2, e}; };
  if (f.kind == Density::Kind::laplace)
    return [](double e) { return std::array<double, 2>{std::abs(e), e == 0 ? 0 : std::copysign(1.0, e)}; };
  const auto log = std::make_shared<const NegativeLog>(f);
  return [log](double e) {
    const auto all = (*log)(e);
    return std::array<double, 2>{all[0], all[1]};
  };
}

// ── uniform noise ──

ParameterSet parameter_set(Regression r, double low, double high) {
  ParameterSet s;
  s.low = low;
  s.high = high;
  s.strips = {r.Phi, r.y.array() - high, r.y.array() - low};
  const LeastSquares ls = ordinary(r);
  s.bounded = ls.rank == r.Phi.cols();
  s.null_space = ls.null_space;
  s.free = free_directions(ls.null_space, r.names);
  s.regression = std::move(r);
  const double middle = (low + high) / 2, half = (high - low) / 2;
  if (s.bounded) {
    s.polytope = polytope(s.strips, exact_strips(s.regression.Phi, s.regression.y, low, high));
    s.feasible = !s.polytope.empty();
  }
  if (!s.feasible) {
    s.smallest = smallest_bound(s.regression.Phi, s.regression.y.array() - middle);
    if (!s.bounded) {  // undetermined components become 0
      const Mat& free = s.null_space;
      s.smallest.theta -= free * Eigen::ColPivHouseholderQR<Mat>(free).solve(s.smallest.theta);
      constexpr double rounding = 1e-12;  // that of the linear program
      s.feasible = s.smallest.bound <= half * (1 + rounding);
    }
    s.center = s.smallest.theta;
  }
  if (!s.feasible) return s;
  if (s.bounded) {
    const Ball ball = largest_ball(s.strips, s.polytope);
    s.center = ball.center;
    s.radius = ball.radius;
    s.box.resize(s.center.size(), 2);
    s.box << s.polytope.vertices.colwise().minCoeff().transpose(),
        s.polytope.vertices.colwise().maxCoeff().transpose();
  } else {
    s.box = intervals(s.strips);
    for (Index i = 0; i < s.box.rows(); ++i)
      if (!ls.identifiable(i))
        s.box.row(i) << -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity();
  }
  return s;
}

std::optional<Index> violated(const ParameterSet& s, const Vec& theta) {
  for (Index t = 0; t < s.strips.Phi.rows(); ++t) {
    const double value = s.strips.Phi.row(t).dot(theta);
    // of the terms: 4500 ε, as in the linear program that found θ
    const double rounding = 1e-12 * (s.strips.Phi.row(t).cwiseAbs().dot(theta.cwiseAbs()) +
                                     std::abs(s.strips.lower[t]) + std::abs(s.strips.upper[t]));
    if (value < s.strips.lower[t] - rounding || value > s.strips.upper[t] + rounding) return t;
  }
  return {};
}

namespace {

std::string shown(const ParameterSet& s, Index vertex, Index i) {
  if (!s.polytope.exact.empty()) return s.polytope.exact[vertex][i].get_str();
  return rounded(s.polytope.vertices(vertex, i), 8);
}

std::string list(const std::vector<Index>& samples) {
  std::vector<std::string> words;
  for (const Index i : samples) words.push_back(std::to_string(i));
  return join(words, ", ");
}

std::string describe_empty(const ParameterSet& s) {
  const double middle = (s.low + s.high) / 2, half = (s.high - s.low) / 2;
  std::vector<Index> samples;
  for (const Index row : s.smallest.rows) samples.push_back(s.regression.sample[row]);
  std::string out = text("  empty: no parameters explain all ", s.regression.y.size(),
                         " rows, the likelihood is 0 everywhere\n");
  const std::string e = middle == 0 ? "|e|" : text("|e - ", rounded(middle), "|");
  out += text("  smallest feasible bound: ", e, " ≤ ", rounded(s.smallest.bound, 8), " instead of ",
              rounded(half), ", decided by sample", samples.size() == 1 ? " " : "s ", list(samples), "\n");
  std::vector<std::string> at;
  for (Index i = 0; i < s.smallest.theta.size(); ++i)
    at.push_back(text(s.regression.names[i], " = ", rounded(s.smallest.theta[i], 8)));
  out += text("  attained at ", join(at, ", "));
  for (const std::string& direction : s.free) out += "\n    " + direction;
  return out;
}

std::string vertex_table(const ParameterSet& s) {
  const Mat& v = s.polytope.vertices;
  constexpr Index most = 12;  // vertices that a screen holds beside the text around them
  if (v.rows() > most) return text("  ", v.rows(), " vertices\n");
  Table table(std::vector<bool>(s.regression.names.size() + 1, true));
  std::vector<std::string> heading{"vertex"};
  heading.insert(heading.end(), s.regression.names.begin(), s.regression.names.end());
  table.row(heading);
  for (Index k = 0; k < v.rows(); ++k) {
    std::vector<std::string> row{std::to_string(k + 1)};
    for (Index i = 0; i < v.cols(); ++i) row.push_back(shown(s, k, i));
    table.row(row);
  }
  return table.str(2);
}

std::string end_of(const ParameterSet& s, Index i, Index side) {
  if (!std::isfinite(s.box(i, side))) return side == 0 ? "-∞" : "∞";
  if (s.bounded)
    for (Index k = 0; k < s.polytope.vertices.rows(); ++k)
      if (s.polytope.vertices(k, i) == s.box(i, side)) return shown(s, k, i);
  return rounded(s.box(i, side), 8);
}

}  // namespace

std::string describe(const ParameterSet& s) {
  const Index N = s.regression.y.size(), d = s.strips.Phi.cols();
  std::string out = text("uniform noise on [", rounded(s.low), ", ", rounded(s.high), "]: ", N,
                         N == 1 ? " row, " : " rows, ", d, d == 1 ? " parameter" : " parameters", "\n");
  if (!s.feasible) return out + describe_empty(s);
  const bool point = s.bounded && s.polytope.vertices.rows() == 1;
  out += text("  the likelihood is ", rounded(1 / (s.high - s.low)),
              N > 1 ? superscript(static_cast<long>(N)) : "",
              point ? " at one point" : " everywhere on this set",
              " and 0 outside: the maximum-likelihood estimate is ", point ? "unique" : "not unique", "\n");
  if (!s.bounded) {
    out += "  the set is unbounded (the regressor has deficient rank)\n";
    for (const std::string& line : s.free) out += "    " + line + "\n";
  } else {
    out += vertex_table(s);
  }
  for (Index i = 0; i < d; ++i)
    out += text("  ", end_of(s, i, 0), " ≤ ", s.regression.names[i], " ≤ ", end_of(s, i, 1), "\n");
  if (s.bounded && !point) {
    std::vector<std::string> at;
    for (const double v : s.center) at.push_back(rounded(v, 7));
    out += text("  Chebyshev centre (", join(at, ", "), "), radius ", rounded(s.radius, 7), "\n");
    if (d == 2)
      out += text("  area ",
                  s.polytope.exact.empty() ? rounded(volume(s.strips, s.polytope), 9)
                                           : text(exact_volume(s.polytope).get_str(), " = ",
                                                  rounded(exact_volume(s.polytope).get_d(), 9)),
                  "\n");
  }
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
