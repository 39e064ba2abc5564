#include "random/distribution.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Eigenvalues>

#include "base/error.hpp"
#include "base/text.hpp"
#include "random/special.hpp"

namespace pendula::random {
namespace {

using Numbers = std::vector<double>;

std::string list_text(const Numbers& numbers) {
  std::vector<std::string> parts;
  for (double p : numbers) parts.push_back(shortest(p));
  return join(parts, ", ");
}

std::string call_text(const char* name, const Numbers& parameters) {
  return std::string(name) + "(" + list_text(parameters) + ")";
}

void require_finite(const char* name, const Numbers& parameters) {
  for (double p : parameters)
    if (!std::isfinite(p)) throw Error(text(name, ": a parameter is ", shortest(p), "; it must be finite"));
}

void require_positive(double value, const char* name) {
  if (!(value > 0)) throw Error(text(name, " must be positive, got ", shortest(value)));
}

class Normal : public Distribution {
 public:
  Normal(double mean, double sigma) : mean_(mean), sigma_(sigma) {}
  Kind kind() const override { return Kind::normal; }
  double quantile(double u) const override { return mean_ + sigma_ * normal_quantile(u); }
  double cdf(double x) const override { return normal_cdf((x - mean_) / sigma_); }
  double mean() const override { return mean_; }
  double deviation() const override { return sigma_; }
  std::string code() const override { return call_text("normal", parameters()); }
  Numbers parameters() const override { return {mean_, sigma_}; }

 private:
  double mean_, sigma_;
};

class Lognormal : public Distribution {
 public:
  Lognormal(double mu, double sigma) : mu_(mu), sigma_(sigma) {}
  Kind kind() const override { return Kind::lognormal; }
  double quantile(double u) const override { return std::exp(mu_ + sigma_ * normal_quantile(u)); }
  double cdf(double x) const override { return x > 0 ? normal_cdf((std::log(x) - mu_) / sigma_) : 0; }
  double mean() const override { return std::exp(mu_ + sigma_ * sigma_ / 2); }
  double deviation() const override { return mean() * std::sqrt(std::expm1(sigma_ * sigma_)); }
  std::string code() const override { return call_text("lognormal", parameters()); }
  Numbers parameters() const override { return {mu_, sigma_}; }

 private:
  double mu_, sigma_;
};

class Uniform : public Distribution {
 public:
  Uniform(double low, double high) : low_(low), high_(high) {}
  Kind kind() const override { return Kind::uniform; }
  double quantile(double u) const override { return low_ + u * (high_ - low_); }
  double cdf(double x) const override { return std::clamp((x - low_) / (high_ - low_), 0.0, 1.0); }
  double mean() const override { return low_ + (high_ - low_) / 2; }
  double deviation() const override { return (high_ - low_) / std::sqrt(12.0); }
  std::string code() const override { return call_text("uniform", parameters()); }
  Numbers parameters() const override { return {low_, high_}; }

 private:
  double low_, high_;
};

class Triangular : public Distribution {
 public:
  Triangular(double low, double mode, double high) : low_(low), mode_(mode), high_(high) {}
  Kind kind() const override { return Kind::triangular; }
  double quantile(double u) const override {
    const double width = high_ - low_, left = mode_ - low_, right = high_ - mode_;
    if (u * width < left) return low_ + std::sqrt(u * width * left);
    return high_ - std::sqrt((1 - u) * width * right);
  }
  double cdf(double x) const override {
    const double width = high_ - low_;
    if (x <= low_) return 0;
    if (x >= high_) return 1;
    if (x < mode_) return (x - low_) * (x - low_) / (width * (mode_ - low_));
    return 1 - (high_ - x) * (high_ - x) / (width * (high_ - mode_));
  }
  double mean() const override { return (low_ + mode_ + high_) / 3; }
  double deviation() const override {
    const double a = mode_ - low_, b = high_ - mode_;
    return std::sqrt((a * a + a * b + b * b) / 18);
  }
  std::string code() const override { return call_text("triangular", parameters()); }
  Numbers parameters() const override { return {low_, mode_, high_}; }

 private:
  double low_, mode_, high_;
};

class Beta : public Distribution {
 public:
  Beta(double a, double b, double low, double high) : a_(a), b_(b), low_(low), high_(high) {}
  Kind kind() const override { return Kind::beta; }
  double quantile(double u) const override { return low_ + (high_ - low_) * beta_quantile(a_, b_, u); }
  double cdf(double x) const override { return beta_cdf(a_, b_, (x - low_) / (high_ - low_)); }
  double mean() const override { return low_ + (high_ - low_) * a_ / (a_ + b_); }
  double deviation() const override {
    return (high_ - low_) / (a_ + b_) * std::sqrt(a_ * b_ / (a_ + b_ + 1));
  }
  std::string code() const override { return call_text("beta", parameters()); }
  Numbers parameters() const override { return {a_, b_, low_, high_}; }

 private:
  double a_, b_, low_, high_;
};

class Exponential : public Distribution {
 public:
  explicit Exponential(double rate) : rate_(rate) {}
  Kind kind() const override { return Kind::exponential; }
  double quantile(double u) const override { return -std::log1p(-u) / rate_; }
  double cdf(double x) const override { return x > 0 ? -std::expm1(-rate_ * x) : 0; }
  double mean() const override { return 1 / rate_; }
  double deviation() const override { return 1 / rate_; }
  std::string code() const override { return call_text("exponential", parameters()); }
  Numbers parameters() const override { return {rate_}; }

 private:
  double rate_;
};

/// Values in ascending order, each with the cumulative probability up to it.
class Discrete : public Distribution {
 public:
  Discrete(Kind kind, Numbers values, Numbers weights) : kind_(kind), values_(std::move(values)) {
    std::vector<std::size_t> order(values_.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](std::size_t i, std::size_t j) { return values_[i] < values_[j]; });
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    double sum = 0, mean = 0, square = 0;
    for (std::size_t i : order) {
      const double p = weights[i] / total;
      sum += p;
      mean += p * values_[i];
      sorted_.push_back(values_[i]);
      weights_.push_back(p);
      up_to_.push_back(sum);
    }
    up_to_.back() = 1;
    for (std::size_t i = 0; i < sorted_.size(); ++i)
      square += weights_[i] * (sorted_[i] - mean) * (sorted_[i] - mean);
    mean_ = mean;
    deviation_ = std::sqrt(square);
    given_weights_ = std::move(weights);
  }
  Kind kind() const override { return kind_; }
  double quantile(double u) const override {
    return sorted_[std::lower_bound(up_to_.begin(), up_to_.end(), u) - up_to_.begin()];
  }
  double cdf(double x) const override {
    const auto at = std::upper_bound(sorted_.begin(), sorted_.end(), x) - sorted_.begin();
    return at == 0 ? 0 : up_to_[at - 1];
  }
  double mean() const override { return mean_; }
  double deviation() const override { return deviation_; }
  std::string code() const override {
    if (kind_ == Kind::empirical) return "empirical({" + list_text(values_) + "})";
    return "discrete({" + list_text(values_) + "}, {" + list_text(given_weights_) + "})";
  }
  Numbers parameters() const override { return values_; }

 private:
  Kind kind_;
  Numbers values_, given_weights_, sorted_, weights_, up_to_;
  double mean_ = 0, deviation_ = 0;
};

}  // namespace

DistributionPtr normal(double mean, double sigma) {
  require_finite("normal", {mean, sigma});
  require_positive(sigma, "sigma");
  return std::make_shared<const Normal>(mean, sigma);
}

DistributionPtr lognormal(double mu, double sigma) {
  require_finite("lognormal", {mu, sigma});
  require_positive(sigma, "sigma");
  return std::make_shared<const Lognormal>(mu, sigma);
}

DistributionPtr uniform(double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || !(low < high))
    throw Error(text("the interval [", shortest(low), ", ", shortest(high),
                     "] is empty or not finite; low must be below high"));
  return std::make_shared<const Uniform>(low, high);
}

DistributionPtr triangular(double low, double mode, double high) {
  require_finite("triangular", {low, mode, high});
  if (!(low < high && low <= mode && mode <= high))
    throw Error(text("the order must be low ≤ mode ≤ high with low < high, got ", shortest(low), ", ",
                     shortest(mode), ", ", shortest(high)));
  return std::make_shared<const Triangular>(low, mode, high);
}

DistributionPtr beta(double a, double b, double low, double high) {
  require_finite("beta", {a, b, low, high});
  require_positive(a, "a");
  require_positive(b, "b");
  if (!(low < high))
    throw Error(text("low must be below high, got ", shortest(low), " and ", shortest(high)));
  return std::make_shared<const Beta>(a, b, low, high);
}

DistributionPtr exponential(double rate) {
  require_finite("exponential", {rate});
  require_positive(rate, "rate");
  return std::make_shared<const Exponential>(rate);
}

DistributionPtr discrete(std::vector<double> values, std::vector<double> weights) {
  if (values.empty()) throw Error("the list of values is empty");
  require_finite("discrete", values);
  if (weights.empty()) weights.assign(values.size(), 1);
  if (weights.size() != values.size())
    throw Error(text("there are ", values.size(), " values but ", weights.size(), " weights"));
  require_finite("discrete", weights);
  for (double w : weights)
    if (w < 0) throw Error(text("a weight is ", shortest(w), "; weights must not be negative"));
  if (!(std::accumulate(weights.begin(), weights.end(), 0.0) > 0)) throw Error("all weights are 0");
  return std::make_shared<const Discrete>(Distribution::Kind::discrete, std::move(values),
                                          std::move(weights));
}

DistributionPtr empirical(std::vector<double> data) {
  if (data.empty()) throw Error("there are no data");
  require_finite("empirical", data);
  std::vector<double> weights(data.size(), 1);
  return std::make_shared<const Discrete>(Distribution::Kind::empirical, std::move(data), std::move(weights));
}

JointNormal::JointNormal(Vec mean, Mat covariance)
    : mean_(std::move(mean)), covariance_(std::move(covariance)) {
  const Eigen::Index n = mean_.size();
  if (n == 0) throw Error("the mean is empty");
  if (covariance_.rows() != n || covariance_.cols() != n)
    throw Error(text("the mean has ", n, " entries, so the covariance must be ", n, "×", n, ", got ",
                     covariance_.rows(), "×", covariance_.cols()));
  if (!mean_.allFinite() || !covariance_.allFinite())
    throw Error("mean or covariance has an entry that is not finite");
  constexpr double printed = 1e-9;  // relative: matrices may be written with nine digits
  const double scale = covariance_.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      if (std::fabs(covariance_(i, j) - covariance_(j, i)) > printed * scale)
        throw Error(text("the covariance is not symmetric: entry (", i + 1, ", ", j + 1, ") is ",
                         shortest(covariance_(i, j)), ", entry (", j + 1, ", ", i + 1, ") is ",
                         shortest(covariance_(j, i))));
  // LDLᵀ without pivoting, in units of the standard deviations; a pivot that is zero up to rounding gives
  // a column 0.
  Vec unit(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (covariance_(i, i) < 0)
      throw Error(text("the variance of entry ", i + 1, " is negative: ", shortest(covariance_(i, i))));
    unit[i] = covariance_(i, i) > 0 ? std::sqrt(covariance_(i, i)) : 1;
  }
  const Mat R = unit.cwiseInverse().asDiagonal() * covariance_ * unit.cwiseInverse().asDiagonal();
  const double least = Eigen::SelfAdjointEigenSolver<Mat>(R, Eigen::EigenvaluesOnly).eigenvalues()[0];
  const double rounding = 1e-12 * static_cast<double>(n);  // of a matrix with entries up to 1: 4500 n ε
  if (least < -rounding)
    throw Error(
        text("the covariance is not positive semidefinite: its correlation matrix has the eigenvalue ",
             rounded(least, 6)));
  factor_ = Mat::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double d = R(j, j) - factor_.row(j).head(j).squaredNorm();
    if (d <= rounding) continue;
    factor_(j, j) = std::sqrt(d);
    for (Eigen::Index i = j + 1; i < n; ++i)
      factor_(i, j) = (R(i, j) - factor_.row(i).head(j).dot(factor_.row(j).head(j))) / factor_(j, j);
  }
  factor_ = unit.asDiagonal() * factor_;
}

double JointNormal::component(int i, const double* z) const {
  double x = mean_[i];
  for (int j = 0; j <= i; ++j) x += factor_(i, j) * z[j];
  return x;
}

}  // namespace pendula::random
