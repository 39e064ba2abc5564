// The mesh of an adaptive run with what its continuous extension needs.
#pragma once

#include <optional>

#include "integrate/event/monitor/monitor.hpp"
#include "integrate/solution/solution.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

class StepHistory : public Continuation, public StepInterpolation {
 public:
  StepHistory(int n, int m) : mesh_(n, m) {}

  Stats stats;  ///< of the steppers, which refer to it as long as they live

  /// From the next step on, steps are this stepper's.
  void use(std::shared_ptr<Stepper> stepper);
  Stepper& stepper() { return *steppers_.back(); }
  /// From the next step on, the problem's modes are these.
  void use_modes(const ProblemPtr& problem, const std::vector<double>& modes);
  /// A point without a step to it: the beginning, or after a jump.
  void begin(const Point& point);
  /// The end of a step with the stepper's record.
  void step_to(const Point& point, const std::vector<double>& record);

  std::pair<double, double> interval(const Points& saved) const override {
    const std::vector<double>& t = forgotten_ ? saved.t() : mesh_.t();
    return {t.front(), t.back()};
  }
  /// Where the times of output are given: once the mesh takes more than some 32 MB it is forgotten, and only
  /// the points at these times are known from then on. Memory is flat, whatever the number of steps.
  void may_forget() { may_forget_ = true; }
  bool has_forgotten() const { return forgotten_; }
  bool interpolate(double t, Point& out) override;
  bool interpolate_roughly(double t, Point& out) override;
  /// Takes back the steps behind t; returns where the history ends now. Requires that nothing is forgotten.
  double cut(double t);
  Point at(const Points& saved, double t) override;
  double errors_beyond_estimates() override;
  std::optional<double> passed_growth() override;
  std::vector<DiscreteStep> steps() override;

 private:
  struct Step {
    std::size_t record;  ///< offset
    int stepper;         ///< none: a jump ends here; integers, since every step has them
    int modes;           ///< or none
    static constexpr int none = -1;
    bool is_jump() const { return stepper == none; }
    bool has_modes() const { return modes != none; }
  };
  Points mesh_;
  std::vector<Step> steps_;  ///< that ends in mesh point i
  std::vector<double> records_;
  std::vector<std::shared_ptr<Stepper>> steppers_;
  struct Modes {
    ProblemPtr problem;
    std::vector<double> values;
    bool operator==(const Modes&) const = default;
  };
  std::vector<Modes> modes_;
  void forget_if_large();
  template <class Ask>
  auto of_step(int mesh_point, const Ask& ask);
  StepView view_;
  std::optional<int> viewed_;
  bool may_forget_ = false, forgotten_ = false;
};

}  // namespace pendula::integrate
