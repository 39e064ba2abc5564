// One accepted step after another, with the step size chosen by an error estimate: what every adaptive method
// looks like to the driver (adaptive_run.hpp). One file per family implements it.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/stats.hpp"
#include "integrate/solve/tolerances.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

class RhsSolver;

/// One step of a finished or running integration, as a continuous extension needs it.
struct StepView {
  Point from, to;
  const double* record = nullptr;  ///< what the stepper's record() wrote
};

/// A step whose error estimate, in tolerances, may be far too small.
struct DoubtfulStep {
  double t;  ///< its beginning
  double estimate;
};

struct StepLimits {
  double dt_first = 0;  ///< 0: chosen
  double dt_max = std::numeric_limits<double>::infinity();
};

/// How much of a point inside a step is wanted.
enum class Detail {
  coarse,  ///< cheap and a little less accurate: to see whether something happens in the step
  state,   ///< x
  full     ///< x, x′ and z
};

class Stepper {
 public:
  Stepper(ProblemPtr problem, Tolerances tolerances, StepLimits limits, Stats& stats)
      : problem_(std::move(problem)), tolerances_(std::move(tolerances)), limits_(limits), stats_(stats) {}
  virtual ~Stepper() = default;
  Stepper(const Stepper&) = delete;
  Stepper& operator=(const Stepper&) = delete;

  virtual std::string name() const = 0;
  /// Begins at a point: x is taken as it is, x′ and z are what the point says where the equations leave a
  /// choice of branch. Throws Failure where they have no solution.
  virtual void start(const Point& point, double end) = 0;
  /// One accepted step that does not pass `end`; here() has moved. Throws Failure: the step size vanished
  /// (says which variable or equation is responsible), the text is without the time.
  virtual void step(double end) = 0;
  const Point& here() const { return here_; }
  const Point& before() const { return before_; }
  /// Until it starts, it stands where the one before it did: a start that fails is explained from there.
  void copy_position(const Stepper& other) {
    here_ = other.here_;
    before_ = other.before_;
  }

  /// How many numbers of a step its continuous extension needs beside the two ends; writes them to `to`.
  virtual std::size_t record_size() const { return 0; }
  virtual void record(double*) const {}
  /// The point at time t of the step. Index 1: with full detail x′ and z solve the equations there. The last
  /// looks that are not coarse are remembered: a root is looked at several times.
  void interpolate(const StepView& step, double t, Detail detail, Point& out);
  /// interpolate() without a memory; says how much of the point it has found.
  virtual Detail look(const StepView& step, double t, Detail detail, Point& out) = 0;

  /// The last interpolated point is less accurate than the end of its step: equations that are held on one
  /// side of a border may have a pole on the other side, and a stage came near it.
  bool is_doubtful() const { return !(error_inside_ <= largest_inside); }
  /// The error of that point, in tolerances, as far as the method knows it.
  double error_inside() const { return error_inside_; }

  /// Steps that what followed them has made doubtful, in the order of time.
  const std::vector<DoubtfulStep>& doubtful_steps() const { return doubtful_steps_; }
  /// The largest component of the error of a step, in tolerances, by two steps of half its length; 0 where
  /// these cannot be made.
  virtual double error_by_doubling(const StepView&) { return 0; }

  /// Do errors of one tolerance grow, by the linearised equations at both ends, to the size of the solution
  /// within the step? An implicit method damps whatever grows so fast, and stays where every neighbour
  /// departs. Seen are real modes, an odd number of them, of small models. docs/derivations.md#growth
  bool passes_growth(const StepView& step);

  /// The Runge–Kutta method of a step; none: another kind of method.
  virtual TableauPtr tableau(const StepView&) const { return nullptr; }

  /// The method evaluates x′ and z from (t, x), and fails where they do not follow from them.
  virtual bool is_explicit() const { return false; }
  /// x′ and z follow from (t, x) by the equations as they stand.
  virtual bool is_determined() const { return true; }
  /// Since the last start, the step size was limited by stability rather than accuracy.
  virtual bool is_stiff() const { return false; }
  /// The stiffness found so far does not justify a change of the method; the test starts again here.
  virtual void restart_stiffness_test() {}
  /// The first step after the next start; 0: chosen.
  void suggest(double dt) { limits_.dt_first = dt; }
  /// The step size it would try next.
  double next_dt() const { return dt_; }
  const Problem& problem() const { return *problem_; }

 protected:
  /// Errors of steps count as at least this, in tolerances: step size formulas divide by them (as in RADAU5).
  static constexpr double least_error = 1e-10;
  /// Of the planned step: a step below it was cut for the end of an interval, not for accuracy.
  static constexpr double as_planned = 0.99;
  /// Of the lengths of the first two corrections. Where x′ has a factor that varies, or z follows from x′, an
  /// error of x returns as one of z, in its tolerances, before both shrink: lengths 5, 4.8, 0.03, 0.015
  /// (pendulum, form "acc", radau, rtol 10⁻⁸). One quotient shows divergence there only above this; up to 2.2
  /// was seen where the iteration converged.
  static constexpr double largest_return = 5;
  /// Of Newton's iterations, in tolerances of the step: as in RADAU5 (Hairer & Wanner II, §IV.8), tighter by
  /// `share`. tightest: of the relative tolerances.
  static double newton_tolerance(double tightest, double share = 1) {
    return std::max(10 * std::numeric_limits<double>::epsilon() / tightest,
                    share * std::min(0.03, std::sqrt(tightest)));
  }
  int n() const { return problem_->n(); }
  int m() const { return problem_->m(); }
  double weight(int i, double size) const { return tolerances_.atol[i] + tolerances_.rtol[i] * size; }
  /// The step, shortened or stretched a little so that the interval ends with a step of decent length.
  double fitted(double dt, double end) const;
  /// A first step that is large enough to change t.
  double visible(double dt, double longest) const;
  /// A first step in which x and x′ change little in units of the tolerance (step_controller.hpp); its error
  /// estimate corrects it.
  double cautious_step(double end) const;
  bool is_visible(double dt) const {
    const double smallest = 10 * std::numeric_limits<double>::epsilon() * std::fabs(here_.t);
    return std::fabs(dt) > smallest && std::fabs(dt) > 1e-300;
  }
  /// A Jacobian is infinite at the root of √|x|: it is evaluated half a step ahead instead and, where the
  /// solution stays there, one tolerance away. take(point): false where it is infinite, too.
  template <class Take>
  bool take_beside(const Take& take) const {
    constexpr double golden = 0.618;
    Point there = here_;
    there.t += dt_ / 2;
    there.x += dt_ / 2 * here_.xdot;
    if (take(there)) return true;
    for (const double side : {1.0, -1.0}) {
      there = here_;
      for (int i = 0; i < n(); ++i)  // not by equal amounts: the root may be of a difference
        there.x[i] += side * (1 + std::fmod(golden * i, 1.0)) * weight(i, std::fabs(here_.x[i]));
      if (take(there)) return true;
    }
    return false;
  }
  /// Errors, in tolerances, up to which a shortened step into an accepted one is trusted; for a smooth
  /// solution none exceeds 1.
  static constexpr double largest_inside = 10;
  /// Rejections in a row after which the starting point is assumed not to satisfy the equations.
  static constexpr int suspicious_failures = 4;
  /// Solves for x′ and z at (t, x) once more. A step satisfies equations without x′ within the tolerances
  /// only; where these equations change by orders of magnitude within a tolerance, no step can begin there,
  /// however small. True where here() has changed.
  bool settle_again(RhsSolver& rhs);
  bool grows(const Point& at, double rate);
  /// |t ∂F/∂t| of every row, by a difference: what rounding of t does to the residuals. y = (x, z).
  std::vector<double> time_terms(double t, const double* y, const double* xdot);
  /// Moves x of a new point onto the conditions of a projected form where it is too far off. Whether x moved;
  /// nothing, with the reason in trouble_, where no point on them is found.
  std::optional<bool> project(Point& next);
  /// The failure of a step too small to change t. `error`: scaled errors that name the culprit, may be empty.
  Failure vanished(const Eigen::Ref<const Vec>& error, const std::string& reason) const;
  /// "x", "z[2]": an entry of y = (x, z).
  std::string unknown_name(int i) const { return i < n() ? problem_->x_name(i) : problem_->z_name(i - n()); }

  ProblemPtr problem_;
  Tolerances tolerances_;
  StepLimits limits_;
  Stats& stats_;
  double error_inside_ = 0;
  /// Of a run, unknowns times steps: all of its steps are doubtful.
  static constexpr long few_values = 3000;
  std::vector<DoubtfulStep> doubtful_steps_;
  std::string trouble_;  ///< why the last attempt at a step failed, other than by its error
  Point here_, before_;
  double dt_ = 0;

 private:
  /// A look into a step of the equations of this version.
  struct Look {
    unsigned version = 0;
    double from = 0, to = 0;
    Vec start, end;
    Detail detail = Detail::coarse;
    double error = 0;
    Point point;
    bool is_of(const StepView& step, double t, unsigned now) const {
      return point.t == t && from == step.from.t && to == step.to.t && version == now &&
             start == step.from.x && end == step.to.x;
    }
  };
  std::array<Look, 4> looks_;
  std::size_t oldest_look_ = 0;
};

/// Cubic Hermite interpolation between the ends of a step; z linear.
void hermite(const StepView& step, double t, Point& out);

}  // namespace pendula::integrate
