// The accuracy of each unknown to which rounding limits Newton's iteration, and whether it suffices.
//
// A residual F_i is known to ε (|∂F_i/∂t t| + Σ |∂F_i/∂y_j y_j|) only, and a multiplier of index 2 or 3 sees
// what that leaves in a constraint divided by dt or dt². At tight tolerances the corrections then stay
// at a level that no smaller step lowers.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "integrate/solve/linear_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class RoundingFloor {
 public:
  enum class Answer {
    no,        ///< the corrections are more than rounding, or more of it than the tolerances allow
    accepted,  ///< converged as far as it can
    raised     ///< so are the tolerances of z, to what can be reached: try again
  };

  /// The iteration matrix in the order of the unknowns y = (x, z), for x′ and y at hand.
  struct Matrix {
    const std::vector<Position>& positions;
    const std::vector<double>& entries;  ///< ∂F/∂y and ∂F/∂x′
    const std::vector<char>& in_mass;    ///< the entry belongs to ∂F/∂x′
    std::vector<double> time_terms;      ///< |t ∂F/∂t|
    std::function<void(double*)> solve;
  };

  RoundingFloor() = default;
  /// index: of every unknown, 1 … 3; the first `states` have an x′. Only tolerances of others are raised: an
  /// error in x stays, one in z is gone with the next step.
  RoundingFloor(std::vector<int> index, int states);
  bool raised() const { return !least_.empty(); }
  bool has_multipliers() const { return has_multipliers_; }
  /// Is a rejected step a reason to test for it? After the first one where there are multipliers, after the
  /// second where there are other unknowns without x′.
  bool may_raise(bool repeated) const { return has_multipliers_ || (repeated && has_algebraic_); }
  void forget() {
    least_.clear();
    trouble = 0;
    worst.reset();
  }

  /// length: the last correction, or the estimated error, in units of the tolerances `scale`; stages: what
  /// the method makes of rounding in one residual. Cost: three solutions.
  Answer judge(const Matrix& matrix, const double* y, const double* xdot, const std::vector<double>& scale,
               double dt, double length, double stages, const Tolerances& tolerances);

  /// The tolerance of unknown k for steps of dt, if it has been raised; else 0.
  double least(int k, double dt, const Tolerances& tolerances) const;

  double floor = 0;    ///< what rounding leaves open, in units of the tolerances
  double trouble = 0;  ///< … of the unknown `worst`, where that is too much for its tolerance; else 0
  std::optional<int> worst;

 private:
  void measure(const Matrix& matrix, const double* y, const double* xdot);
  std::vector<int> index_;
  std::vector<char> raisable_;
  bool has_multipliers_ = false, has_algebraic_ = false;
  std::vector<double> open_;   ///< by rounding, of every unknown
  std::vector<double> least_;  ///< tolerances without their relaxation; empty: as given
};

/// "Rounding errors in the equations change v[6] by 2e-9 …"
std::string raised_text();
std::string rounding_text(const RoundingFloor& rounding, const std::string& name);

}  // namespace pendula::integrate
