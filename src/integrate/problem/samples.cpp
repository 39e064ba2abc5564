#include "integrate/problem/samples.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::integrate {

Samples::Samples(std::vector<double> t, std::vector<double> values, Hold hold, std::string name)
    : t_(std::move(t)), values_(std::move(values)), hold_(hold), name_(std::move(name)) {
  const std::size_t fewest = hold == Hold::linear ? 2 : 1;
  if (t_.size() != values_.size())
    throw Error(text("input '", name_, "': ", t_.size(), " times for ", values_.size(), " values"));
  if (t_.size() < fewest)
    throw Error(text("input '", name_, "': ", t_.size(), " samples; at least ", fewest, " are needed"));
  for (std::size_t i = 0; i < t_.size(); ++i) {
    if (!std::isfinite(t_[i]) || !std::isfinite(values_[i]))
      throw Error(text("input '", name_, "': sample ", i + 1, " is not a finite number"));
    if (i > 0 && t_[i] <= t_[i - 1])
      throw Error(text("input '", name_, "': the times must ascend, but t[", i + 1, "] = ", rounded(t_[i]),
                       " follows ", rounded(t_[i - 1])));
  }
  end_ = t_.back();
  if (hold == Hold::zero) end_ = t_.size() > 1 ? 2 * end_ - t_[t_.size() - 2] : HUGE_VAL;
}

/// The index i of the piece [tᵢ, tᵢ₊₁) that contains t.
std::size_t Samples::piece(double t) {
  // sums of thousands of steps err by thousands of ε
  const double rounding = 1e-12 * std::max({std::fabs(t_.front()), std::fabs(t_.back()), 1e-300});
  if (t < t_.front() - rounding || t > end_ + rounding)
    throw Failure(
        text("the input ", name_, " is known for ", rounded(t_.front()), " ≤ t ≤ ", rounded(end_), " only"));
  const auto inside = [&](std::size_t i) { return t_[i] <= t && (i + 1 == t_.size() || t < t_[i + 1]); };
  if (inside(last_)) return last_;
  if (last_ + 1 < t_.size() && inside(last_ + 1)) return ++last_;
  const auto after = std::upper_bound(t_.begin(), t_.end(), t);
  last_ = after == t_.begin() ? 0 : static_cast<std::size_t>(after - t_.begin()) - 1;
  return last_;
}

double Samples::operator()(double t) {
  const std::size_t i = piece(t);
  if (hold_ == Hold::zero || i + 1 == t_.size()) return values_[i];
  return values_[i] + (values_[i + 1] - values_[i]) * ((t - t_[i]) / (t_[i + 1] - t_[i]));
}

double Samples::slope(double t) {
  const std::size_t i = std::min(piece(t), t_.size() - 2);
  return (values_[i + 1] - values_[i]) / (t_[i + 1] - t_[i]);
}

}  // namespace pendula::integrate
