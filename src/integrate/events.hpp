// Roots of event functions along a solution, and what happens there.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "integrate/projection.hpp"
#include "integrate/stepper.hpp"

namespace pendula::integrate {

/// What a callback wants done after it has seen the event.
struct EventReply {
  bool stop = false;
  std::vector<std::pair<Expr, double>> reset;  ///< state -> new value
};

struct Event {
  Expr when;          ///< in leaves of the problem; the event is a root of it
  int direction = 0;  ///< -1: only where it falls, 1: only where it rises
  bool stop = false;
  std::vector<std::pair<Expr, Expr>> reset;  ///< state -> its value after, in the values before
  std::function<EventReply(const Point&)> call;
  bool surface = false;  ///< not the user's: the equations are not smooth there
};

struct EventList {
  std::vector<Event> list;
  /// Conditions that the states must satisfy after a reset, level by level; `reset` says which states keep
  /// their new value. Throws Error when they cannot.
  std::function<void(Point&, const std::vector<int>& reset)> reinitialise;
};

/// The surfaces on which F is not smooth: arguments of abs and sign, differences of min, max and conditions.
std::vector<Expr> switching_surfaces(std::span<const Expr> F);

/// Finds the first root inside a step.
class EventFinder {
 public:
  EventFinder(const ProblemPtr& problem, const std::vector<Event>& events);

  struct Hit {
    double t;       ///< where the sign has changed
    double before;  ///< the last moment before
    int which;
    bool rising;
  };
  bool empty() const { return events_.empty(); }
  /// A new beginning at a point: what is zero here does not count as a root here.
  void start(const Point& point);
  /// The first root in (from, to], where `from` is the last start or root, located to a few ulp of t.
  std::optional<Hit> find(Stepper& stepper, const StepView& step);
  /// After a root that changes nothing: go on behind it.
  void pass(const Hit& hit, Stepper& stepper, const StepView& step);

 private:
  struct Sample {
    double t = 0;
    std::vector<double> g, slope;
  };
  void evaluate(const Point& point, Sample& out);
  void sample(Stepper& stepper, const StepView& step, double t, Detail detail, Sample& out);
  struct Root {
    double before, t;
  };
  std::optional<Root> root_between(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                   const Sample& b);
  Root locate(Stepper& stepper, const StepView& step, int which, double a, double ga, double b, double gb);
  std::optional<double> dip(Stepper& stepper, const StepView& step, int which, const Sample& a,
                            const Sample& b);
  double value(Stepper& stepper, const StepView& step, int which, double t);
  std::optional<Hit> first_hit(Stepper& stepper, const StepView& step, const Sample& a, const Sample& b);

  ProblemPtr problem_;
  const std::vector<Event>& events_;
  codegen::Kernel kernel_;         ///< g, then dg/dt
  std::vector<char> slope_known_;  ///< dg/dt contains nothing but known leaves
  bool needs_derivatives_ = false;
  Sample last_;  ///< at the last point looked at; signs of zeros are those just after
  std::vector<Sample> samples_;
  Sample probe_;
  Point point_;
  std::vector<double> out_;
};

}  // namespace pendula::integrate
