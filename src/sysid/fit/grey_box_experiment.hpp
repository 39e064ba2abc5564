// One experiment of a grey-box fit: its simulation with sensitivities, over the
// whole record or its first part.
#pragma once

#include "sysid/fit/grey_box.hpp"

namespace pendula::sysid {

inline bool is_parameter(Expr p) { return symbol_of(p).kind == Kind::parameter; }

class Experiment {
 public:
  /// The request must live as long as the experiment. A model of higher index is reduced.
  Experiment(const GreyBoxRequest& r, Index number);

  /// From now on only this share of the samples counts, at least two.
  void shorten(double share);
  /// Does sample k of the data belong to this experiment, and count?
  bool covers(Index k) const { return k >= first_ && k < first_ + static_cast<Index>(times_.size()); }
  /// States whose initial values the start leaves undetermined, with values to begin with. Where init fails
  /// for another reason, its error is thrown on.
  dae::LeafValues open_values(const Vec& theta) const;
  /// Simulates at θ: the rows of this experiment in values (N×ny), and the gradient of all samples of output
  /// j in rows j N … . Throws Failure when the model cannot be integrated at θ.
  void run(const Vec& theta, Mat& values, Mat& J);

  std::string form, method;  ///< the reduced form, if any; the method of the last run

 private:
  /// Does parameter i belong to this experiment?
  bool owns(std::size_t i) const { return r_.owner.empty() || !r_.owner[i] || r_.owner[i] == number_; }
  dae::StartRequest start_at(const Vec& theta) const;
  integrate::Simulation simulation_at(const Vec& theta) const;

  const GreyBoxRequest& r_;
  Index number_, first_ = 0;
  dae::ModelPtr model_;
  std::vector<double> times_;
  std::vector<std::pair<Expr, integrate::Problem::Input>> inputs_;
};

/// Residuals and gradient at the samples that are there and count.
struct GreyBoxPoint {
  Mat values;  ///< N×ny
  Vec e;
  Mat J;
  double sse = 0;
};
GreyBoxPoint evaluate(std::vector<Experiment>& experiments, const GreyBoxRequest& r, const Vec& theta);

}  // namespace pendula::sysid
