// How many steps an explicit pair would take, forecast along the solution while an implicit method runs.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>

#include "integrate/step/spectrum.hpp"

namespace pendula::integrate {

/// Compares the work of the implicit steps on a stretch of the solution with that of explicit steps: as many
/// as stability requires, by |λ| measured every few steps, and at least as many as accuracy requires,
/// estimated from the implicit ones. A new stretch begins where a step is longer than all before (earlier
/// steps do not predict later ones), and where explicit steps would be far too many. Derivation:
/// docs/derivations.md#choice-of-the-method; the constants were measured with bench/choice.lua: half or twice
/// as large they change the mean of all runs by 0.005 (docs/performance.md).
class ExplicitForecast {
 public:
  /// Of the run so far; work in steps of the explicit pair.
  struct Progress {
    long steps = 0;
    double work = 0;
  };

  /// An implicit method begins. accurate: explicit steps for each of its own where accuracy limits both.
  /// apart: steps between two measurements, at the least.
  void begin(const Progress& now, double accurate, long apart);
  /// After every step.
  void step(double dt);
  bool is_due(long steps) const { return steps >= next_; }
  void wait_until(long steps) { next_ = std::max(next_, steps); }
  /// Measures |λ| and adds the steps since the last measurement to the stretch. Cost: two
  /// evaluations of x′, four at first.
  void measure(const ProblemPtr& problem, const Point& here, const Progress& now);

  /// Would explicit steps be less work from here on, as on the stretch? left: time.
  bool is_less_work(double left);

  double time() const { return time_; }  ///< of the stretch
  double implicit_work_per_time() const {
    return spent_ / time_;
  }  ///< requires is_less_work() to have been true

  /// A change has turned out wrong: the next one takes a longer stretch.
  void lengthen_stretch() { enough_ *= 8; }
  /// What explicit steps have settled at: |λ| h.
  void learn(double settled) { settled_ = std::min(settled_, settled); }
  /// The implicit method is on trial: with no more work than the explicit one before it is kept.
  /// explicit_work: of the explicit method per time, where it was counted.
  void put_on_trial(double explicit_work = 0) {
    on_trial_ = true;
    counted_ = explicit_work;
  }

 private:
  std::optional<double> radius_at(const ProblemPtr& problem, const Point& here);
  void restart();
  void forget();

  Stats unused_;
  ProblemPtr problem_;
  std::unique_ptr<RhsSolver> derivative_;
  SpectralRadius spectrum_;
  std::optional<double> radius_;  ///< at the last measurement
  double settled_ = 3, accurate_ = 1;
  long next_ = 0, apart_ = 0, few_ = 0, enough_ = 16;  ///< steps
  bool on_trial_ = false, has_grown_ = false;
  double counted_ = 0;  ///< work of the explicit method per time; 0: forecast
  double longest_ = 0;  ///< step so far
  Progress last_;       ///< measurement
  double t_ = 0;
  double time_ = 0, steps_ = 0, spent_ = 0;  ///< the stretch: explicit steps, work of the implicit ones
  long implicit_ = 0;
};

}  // namespace pendula::integrate
