// Pulses of z that begin and end between the points of a step at which the equations hold, as of the current
// behind a rectifier: no error estimate detects them.
//
// docs/derivations.md#step-checks. For a z that the equations are not linear in.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/math.hpp"

namespace pendula::integrate {

class PulseWatch {
 public:
  /// A step as a method has made it.
  struct Step {
    double t, dt;
    std::span<const double> nodes;  ///< ascending parts of the step, at whose ends the equations hold
    int samples;                    ///< between two nodes; odd
    /// y = (x, z) and x′ of the continuous extension at this part of the step.
    std::function<void(double part, double* y, double* slope)> curve;
    const std::vector<double>& scale;  ///< the tolerances of y
  };

  /// At time t, from those of the continuous extension to x′ and z of the equations;
  /// false: they do not determine x′ and z there.
  using Equations = std::function<bool(double t, const double* y, Vec& xdot, Vec& z)>;

  PulseWatch(int n, int m);
  void start(const Vec& z);
  /// A step from z to z_end; include() what z is between them.
  void begin(const Vec& z, const Vec& z_end);
  void include(const double* z);
  /// Can the step hide a pulse of a z? Yes where z moves, by more than rounding, over a quarter of the range
  /// that it has covered since the start (a sixth of a period). A monotone z, as in a transient,
  /// hides no pulse: it would have to return between two new values. A z that has not moved yet is
  /// checked in the first step in which it does. scale: the tolerances of (x, z).
  bool is_due(const std::vector<double>& scale) const;
  /// The distance of z of the continuous extension from z of the equations, in units of a tenth of the range
  /// of z in the step; 2 where the equations have no solution. Integrates the difference of their x′ for
  /// missed_norm(), in parts of dt, by Simpson's rule.
  double distance_from_equations(const Step& step, const Equations& equations);
  /// The error of x by that integral in a step of size dt, in the tolerances `scale`. filter(missed, e): the
  /// error e of (x, z) that is left of it where the equations are stiff, as in the error estimate of the
  /// method; false where there is none. Called only where h times the integral is visible.
  double missed_norm(double dt, const std::vector<double>& scale,
                     const std::function<bool(const Vec&, std::vector<double>&)>& filter);
  /// The step counts.
  void accept();

 private:
  struct Range {
    double low = 0, high = 0;
    void include(double value);
    double width() const { return high - low; }
  };
  int n_;
  std::vector<Range> ranges_;   ///< of every z since the start
  std::vector<Range> in_step_;  ///< since begin()
  Vec missed_;
  std::vector<double> y_, slope_;
};

}  // namespace pendula::integrate
