#include "sysid/regression/kernel.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::sysid {

Kernel kernel_named(const std::string& name) {
  if (name == "TC" || name == "tc") return Kernel::tc;
  if (name == "DC" || name == "dc") return Kernel::dc;
  throw Error(
      text("unknown kernel '", name, "' (TC: smooth and decaying; DC: with a correlation of its own)"));
}

namespace {

/// The minimum of f by the simplex method of Nelder and Mead (Comput. J. 7, 1965) around x.
Vec simplex_minimum(const std::function<double(const Vec&)>& f, const Vec& x, int evaluations) {
  const Index n = x.size();
  std::vector<std::pair<double, Vec>> points{{f(x), x}};
  for (Index i = 0; i < n; ++i) {
    Vec p = x;
    p[i] += 1;
    points.emplace_back(f(p), p);
  }
  const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
  for (int used = 0; used < evaluations;) {
    poll_interrupt();
    std::sort(points.begin(), points.end(), less);
    auto& worst = points.back();
    // f is -2 ln of a likelihood: changes of 1 matter, and at the minimum 10⁻⁹ is a change of x by √ of it
    constexpr double settled = 1e-9;
    if (worst.first - points[0].first < settled * (1 + std::abs(points[0].first))) break;
    Vec middle = Vec::Zero(n);
    for (Index i = 0; i < n; ++i) middle += points[i].second / static_cast<double>(n);
    const auto at = [&](double s) {
      const Vec p = middle + s * (worst.second - middle);
      ++used;
      return std::pair(f(p), p);
    };
    const auto reflected = at(-1);
    if (reflected.first < points[0].first) {
      worst = std::min(at(-2), reflected, less);
    } else if (reflected.first < points[points.size() - 2].first) {
      worst = reflected;
    } else if (const auto inside = at(reflected.first < worst.first ? -0.5 : 0.5);
               inside.first < std::min(worst.first, reflected.first)) {
      worst = inside;
    } else {
      for (std::size_t i = 1; i < points.size(); ++i) {
        points[i].second = 0.5 * (points[i].second + points[0].second);
        points[i].first = f(points[i].second);
        ++used;
      }
    }
  }
  return std::min_element(points.begin(), points.end(), less)->second;
}

/// Converts hyperparameters from unbounded numbers: ln κ, ln λ/(1-λ), ln ρ/(1-ρ).
KernelGroup group_of(const Vec& x) {
  const auto share = [](double v) { return 1 / (1 + std::exp(-v)); };
  return {std::exp(x[0]), share(x[1]), x.size() > 2 ? share(x[2]) : 0};
}

Mat kernel_matrix(const KernelGroup& g, Index n, Kernel kernel) {
  Mat K(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const auto a = static_cast<double>(i + 1);
      const auto b = static_cast<double>(j + 1);
      K(i, j) = g.size * (kernel == Kernel::tc
                              ? std::pow(g.decay, std::max(a, b))
                              : std::pow(g.decay, (a + b) / 2) * std::pow(g.correlation, std::abs(a - b)));
    }
  return K;
}

class Evidence {
 public:
  Evidence(const Mat& R, Index rows, const std::vector<Index>& sizes, Kernel kernel)
      : n_(R.rows() - 1),
        rows_(static_cast<double>(rows)),
        R1_(R.topLeftCorner(n_, n_)),
        R2_(R.col(n_).head(n_)),
        rest_(R(n_, n_) * R(n_, n_)),
        sizes_(sizes),
        kernel_(kernel) {}

  /// -2 ln p(y) up to a constant, maximised over σ².
  double operator()(const std::vector<KernelGroup>& groups) {
    const Mat P = prior(groups);
    factor_.compute(Mat::Identity(n_, n_) + R1_ * P * R1_.transpose());
    if (factor_.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const double spread = rest_ + R2_.dot(factor_.solve(R2_));
    sigma2_ = spread / rows_;
    if (!(sigma2_ > 0)) return -std::numeric_limits<double>::infinity();
    return rows_ * std::log(sigma2_) + 2 * factor_.matrixLLT().diagonal().array().log().sum();
  }

  Mat prior(const std::vector<KernelGroup>& groups) const {
    Mat P = Mat::Zero(n_, n_);
    Index at = 0;
    for (std::size_t k = 0; k < groups.size(); ++k) {
      const Index size = sizes_[k];
      P.block(at, at, size, size) = kernel_matrix(groups[k], size, kernel_);
      at += size;
    }
    return P;
  }

  RegularisedFit fit(const std::vector<KernelGroup>& groups) {
    RegularisedFit out;
    out.groups = groups;
    const double value = (*this)(groups);
    const Mat P = prior(groups);
    const Mat gain = P * R1_.transpose();
    out.theta = gain * Vec(factor_.solve(R2_));
    out.sigma2 = sigma2_;
    out.covariance = sigma2_ * (P - gain * Mat(factor_.solve(Mat(gain.transpose()))));
    out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
    out.effective = static_cast<double>(n_) - Mat(factor_.solve(Mat(Mat::Identity(n_, n_)))).trace();
    out.sse = rest_ + (R2_ - R1_ * out.theta).squaredNorm();
    out.log_likelihood = -0.5 * (value + rows_ * (1 + std::log(2 * M_PI)));
    return out;
  }

 private:
  Index n_;
  double rows_;
  Mat R1_;
  Vec R2_;
  double rest_, sigma2_ = 0;
  const std::vector<Index>& sizes_;
  Kernel kernel_;
  Eigen::LLT<Mat> factor_;
};

/// Sizes of the columns: one number per group, and the norm of y.
Vec units(const Mat& R, const std::vector<Index>& sizes) {
  Vec out(R.cols());
  Index at = 0;
  for (const Index size : sizes) {
    const double norm =
        R.middleCols(at, size).norm() / std::sqrt(static_cast<double>(std::max<Index>(size, 1)));
    out.segment(at, size).setConstant(norm > 0 ? norm : 1);
    at += size;
  }
  out[at] = R.col(at).norm();
  return out;
}

}  // namespace

RegularisedFit regularised(const Mat& R, Index rows, const std::vector<Index>& sizes, Kernel kernel) {
  if (!R.allFinite() || R.col(R.cols() - 1).norm() == 0)
    throw Failure("regularised least squares: the output is zero");
  const Vec unit = units(R, sizes);  // scales hyperparameters to the same range for all data
  Evidence evidence(R * unit.cwiseInverse().asDiagonal(), rows, sizes, kernel);
  const double many = std::log(static_cast<double>(rows));
  std::vector<KernelGroup> groups(sizes.size());
  const Index count = kernel == Kernel::tc ? 2 : 3;
  double best = std::numeric_limits<double>::infinity();
  std::vector<KernelGroup> found = groups;
  // choices: three starts, as the evidence may have several maxima, and three rounds over several groups
  constexpr double correlated = 3;  // ρ = 0.95
  constexpr int rounds = 3, evaluations = 250;
  // logits: beyond ±30 a share is 0 or 1 to 10⁻¹³, beyond ±40 it rounds to it
  constexpr double largest_start = 30, largest_logit = 40;
  for (const double decay : {0.0, 1.5, 3.0}) {  // λ = 0.5, 0.82, 0.95
    for (KernelGroup& g : groups) g = group_of(Vec{{many, decay, correlated}});
    for (int pass = 0; pass < (groups.size() > 1 ? rounds : 1); ++pass)
      for (KernelGroup& g : groups) {
        Vec x{{std::log(g.size), std::log(g.decay / (1 - g.decay)), correlated}};
        if (kernel == Kernel::dc) x[2] = std::log(g.correlation / (1 - g.correlation));
        x = x.cwiseMax(-largest_start)
                .cwiseMin(largest_start);  // the share of an unneeded group may have rounded to 0 or 1
        const auto value = [&](const Vec& at) {
          if (at.cwiseAbs().maxCoeff() > largest_logit) return std::numeric_limits<double>::infinity();
          g = group_of(at);
          return evidence(groups);
        };
        g = group_of(simplex_minimum(value, x.head(count), evaluations));
      }
    if (const double v = evidence(groups); v < best || best == std::numeric_limits<double>::infinity()) {
      best = v;
      found = groups;
    }
  }
  RegularisedFit out = evidence.fit(found);
  const Index n = unit.size() - 1;
  const Vec back = unit[n] * unit.head(n).cwiseInverse();
  const double y2 = unit[n] * unit[n];
  out.theta = back.cwiseProduct(out.theta);
  out.covariance = back.asDiagonal() * out.covariance * back.asDiagonal();
  out.sigma2 *= y2;
  out.sse *= y2;
  out.log_likelihood -= static_cast<double>(rows) * std::log(unit[n]);
  return out;
}

}  // namespace pendula::sysid
