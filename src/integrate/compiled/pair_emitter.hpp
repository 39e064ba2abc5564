// Writes one step of an explicit Runge-Kutta pair into a program: stages, end, error
// estimate, stiffness estimate.
//
// The same formulas in the same order for a single run (explicit_step.hpp) and for
// lanes (lane_step.hpp): equal bits.
#pragma once

#include <functional>

#include "integrate/compiled/formula.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

class PairEmitter {
 public:
  /// f at stage i (i = stages: at the end of the step) and x, n values.
  using Slope = std::function<Slots(int, const Slots&)>;

  /// A step of length h from x with x′. Requires an explicit method. Stages are
  /// written when something needs them.
  PairEmitter(codegen::Writer& w, const Tableau& rk, Formula h, Slots x, Slots xdot, Slope slope);

  const Slots& slope(int stage);
  /// x + h Σ factorsⱼ Kⱼ; written once for equal factors.
  const Slots& point(std::vector<double> factors);
  const Slots& end() { return point({rk_.b().begin(), rk_.b().end()}); }
  Slots slope_at_end() { return rk_.is_fsal() ? slope(rk_.stages() - 1) : slope_(rk_.stages(), end()); }

  /// 1/(atol + rtol max(|x|, |x₁|)).
  Slots weights(const Slots& rtol, const Slots& atol);
  /// h Σ (bⱼ - b̂ⱼ) Kⱼ, scaled; zeros where there is no b̂.
  Slots error(const std::optional<Vec>& embedded, const Slots& weight);
  Slots squares(const Slots& list);

  /// Sums of the scaled squares of f(x₁) - f(g) and x₁ - g, g: a second stage at the end of the step.
  struct Differences {
    codegen::Slot slopes, points;
  };
  Differences differences(int g, const Slots& xdot, const Slots& weight);

 private:
  Formula value(codegen::Slot slot) const { return {w_, slot}; }
  codegen::Slot sum(const std::vector<double>& factors, std::size_t k);
  std::vector<double> row(int stage) const;

  codegen::Writer& w_;
  const Tableau& rk_;
  Formula h_;
  Slots x_;
  Slope slope_;
  std::vector<Slots> K_;  ///< empty: not written yet
  struct Known {
    std::vector<double> factors;  ///< without the zeros at the end
    Slots x;
  };
  std::vector<Known> points_;
};

}  // namespace pendula::integrate
