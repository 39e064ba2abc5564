// Peaks that a step has jumped over: e^{-u²} and 1/(w² + u²) where u passes 0 between two stages.
//
// An error estimate knows the equations at the stages. Where an exponent has a maximum inside a step, or a
// divisor a least value, far from its values at both ends, the equations may hold a pulse that no stage has
// seen, and the run would finish without it. Functions of t alone are sampled before a run
// (event/pulses.hpp); this monitor treats functions of the solution.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class PeakMonitor : public StepMonitor {
 public:
  /// Exponents and divisors of a problem of index 0 or 1, in t and x. wanted = false: none. Cost after every
  /// step: one evaluation of them and their derivatives; two where they vary fast, up to eight where cubics
  /// do not follow them; nothing where there are none.
  PeakMonitor(const Problem& problem, const Tolerances& tolerances, bool wanted);

  void restart(const ProblemPtr& problem, const Point& point) override;
  /// Shorter steps, if the step has jumped over a peak whose error is not admissible; tolerated where more
  /// than a quarter of the steps were made again: peaks without end. Cost: where there is one, some 30
  /// evaluations of exponents and five of x′.
  std::optional<Rejection> after(const ProblemPtr& problem, const Point& from, const Point& to) override;
  bool is_empty() const override { return nodes() == 0; }

 private:
  void follow(const ProblemPtr& problem);
  bool has_reached_limit() const;
  const ProblemPtr& own();
  using Values = std::vector<double>;  ///< u of all nodes, then their slopes
  struct Sample {
    double share = 0;
    Values values;
  };
  /// Where in the step, and half its width, as shares of the step.
  struct Peak {
    double at, width;
  };
  /// What follows from the equations alone.
  struct Nodes {
    std::vector<char> is_divisor;   ///< of every node
    std::vector<char> is_parabola;  ///< in t: turns inside a step where its slopes at the ends say so
    codegen::Kernel kernel;         ///< u of all nodes, then their slopes
  };
  static constexpr int most_searched = 16;  ///< peaks in a step
  static constexpr int deepest = 3;         ///< halvings of a step

  static Nodes nodes_of(const Problem& problem);
  std::size_t nodes() const { return nodes_.is_divisor.size(); }
  void evaluate(const Point& point, Values& out);
  void sample(const Point& from, const Point& to, double share, Sample& out);
  bool varies_fast() const;
  double passes_peak(const Sample& low, const Sample& behind, int depth, const Point& from, const Point& to);
  bool shows_no_peak(const Sample& low, const Sample& middle, const Sample& behind) const;
  double peak_height(std::size_t i) const;
  bool may_reach_peak(std::size_t i, const Sample& low, const Sample& behind) const;
  bool turns(std::size_t i, const Values& low, const Values& behind) const;
  std::optional<Peak> peak_between(std::size_t i, const Sample& low, const Sample& behind, const Point& from,
                                   const Point& to);
  template <class Fallen>
  double half_width(double top, const Fallen& has_fallen);
  double peak_error(std::size_t i, const Peak& peak, const Point& from, const Point& to);
  bool stops_in(std::size_t i, const Peak& peak, const Point& from, const Point& to);
  bool equations_at(const Point& from, const Point& to, double share, Vec& xdot);

  ProblemPtr original_;  ///< that of the run
  unsigned version_ = 0;
  ProblemPtr own_;
  Values arguments_;  ///< of the kernel, where the model has no inputs
  Tolerances tolerances_;
  Nodes nodes_;
  Sample last_{0, {}}, next_{1, {}};  ///< at the ends of the last step
  Sample middles_[deepest];
  Sample low_, behind_, middle_;  ///< of a search
  double dt_ = 0;                 ///< of the step under inspection
  int searched_ = 0;
  Stats ignored_;
  std::unique_ptr<RhsSolver> rhs_;
  Point inside_;
  Vec at_peak_, at_foot_, beside_;
  long steps_ = 0, repeated_ = 0;
};

}  // namespace pendula::integrate
