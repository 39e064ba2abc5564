// Expressions that must not vanish along a solution, after steps of a fixed size.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "integrate/event/monitor/rank_monitor.hpp"
#include "integrate/run/fixed_step_run.hpp"

namespace pendula::integrate {

/// The guards of a run: what the model's form divided by, and what its equations need to be solvable.
std::vector<Guard> guards_of(const dae::ModelPtr& model, const Substitution& inputs, const Problem& problem,
                             bool all_values);

/// The blocks of a run whose entries are known where it computes, with its inputs.
std::vector<dae::LargeBlock> blocks_of(const dae::ModelPtr& model, const Substitution& inputs,
                                       const Problem& problem);

/// A point at a share of a step: cubic Hermite interpolation of x, linear of x′ and z.
void between(const Point& from, const Point& to, double share, Point& out);

/// Form "minimal" has taken the root y = -√D of a constraint, and y should go on to positive values: D
/// touches 0, and the form goes on from there with the mirror image. Its trace is a kink: √D falls and rises
/// again with opposite slopes, so that -√D on one side goes on smoothly as +√D on the other. Told by the
/// trapezoidal rule between two points on both sides: √D₂ - √D₁ against -√D₂ - √D₁.
class RootWatch {
 public:
  RootWatch(const ProblemPtr& problem, const std::vector<Guard>& guards);
  bool empty() const { return roots_.empty(); }
  void start(const Point& point);
  struct Hit {
    double t;
    std::string reason;
  };
  std::optional<Hit> after(const Point& point);

 private:
  struct Sample {
    double t, s, slope;
  };
  std::optional<double> kink(const std::deque<Sample>& list) const;
  ProblemPtr problem_;
  std::vector<Guard> roots_;
  codegen::Kernel kernel_;  ///< √D, then its derivative
  std::vector<double> out_;
  std::vector<std::deque<Sample>> last_;
  std::vector<double> largest_;
};

/// Looks at the guards after every step. A sign that differs from the one before is a zero in between; so is
/// a value that, by the slopes at both ends, was nearer to zero in between and reached it to 1e-9.
class GuardWatch {
 public:
  GuardWatch(const ProblemPtr& problem, const Plan& plan);
  bool empty() const { return guards_.empty() && ranks_.empty(); }
  /// The run ended at this time, some steps ago.
  std::optional<double> cut() const { return cut_; }
  void start(const Point& point);
  /// Why the run ends in the step from the last point to this one: "stopped at t = 0.5: …". The time by cubic
  /// interpolation between the two.
  std::optional<std::string> after(const Point& point);
  /// After a failure: what is at most `almost` times what it was at the start (or, with
  /// fixed steps, would be zero two steps later), and what that means; or "".
  std::string almost_zero(const Point& point, double almost = 0.05);

 private:
  struct Sample {
    std::vector<double> g, slope;
  };
  Sample evaluate(const Point& point);
  const Point& point_between(const Point& end, double share);
  double between(const Point& end, double share, std::size_t which);
  std::optional<double> zero(const Point& end, const Sample& there, std::size_t which);

  ProblemPtr problem_;
  const std::vector<Guard>& guards_;
  RankWatch ranks_;
  RootWatch roots_;
  std::optional<double> cut_;
  codegen::Kernel kernel_;  ///< g, then dg/dt where it is known, else 0
  std::vector<double> out_;
  Point last_, between_;
  Sample here_;
  std::vector<double> first_, before_;  ///< g at the start, and one step before the last point
};

}  // namespace pendula::integrate
