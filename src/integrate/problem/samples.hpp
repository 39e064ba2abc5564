// Inputs known at samples: held or interpolated between them.
//
//   const Samples u({0, 1, 2}, {5, 6, 4}, Samples::Hold::linear, "u");
//   u(0.5) = 5.5,  u.slope(0.5) = 1;  u.breaks() = {0, 1, 2}: there steps have to end
#pragma once

#include <string>
#include <vector>

namespace pendula::integrate {

class Samples {
 public:
  enum class Hold {
    zero,   ///< constant until the next sample; the last one holds for as long as the one before it
    linear  ///< straight lines; known from the first to the last sample
  };
  /// Throws Error on times that do not ascend, what is not finite, different lengths, fewer than 2 samples
  /// (linear) or 1 (zero). name: of the input, for messages.
  Samples(std::vector<double> t, std::vector<double> values, Hold hold, std::string name);

  /// Throws Failure outside the interval. Cost: O(1) where t moves little from call to call.
  double operator()(double t);
  /// Its derivative; at a sample that on the right. Requires Hold::linear.
  double slope(double t);
  const std::vector<double>& breaks() const { return t_; }

 private:
  std::size_t piece(double t);
  std::vector<double> t_, values_;
  Hold hold_;
  double end_;
  std::string name_;
  std::size_t last_ = 0;
};

}  // namespace pendula::integrate
