// Any one-step method on the active part of a large model (active_subsystem.hpp), which
// grows as far as something happens.
#pragma once

#include <functional>

#include "integrate/problem/active_subsystem.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

class SubsystemStepper final : public Stepper {
 public:
  /// The stepper for a part, with these tolerances.
  using Make = std::function<std::shared_ptr<Stepper>(const ProblemPtr&, const Tolerances&)>;

  SubsystemStepper(ProblemPtr problem, std::shared_ptr<const DependencyGraph> couplings, Make make,
                   Tolerances tolerances, StepLimits limits, Stats& stats);

  std::string name() const override { return inner().name(); }
  void start(const Point& point, double end) override;
  /// A step that moves the interface is taken back and repeated in a part four times as large.
  void step(double end) override;
  std::size_t record_size() const override { return 1 + inner().record_size(); }
  void record(double* to) const override;
  bool is_determined() const override { return false; }  // of the unknowns at work alone
  TableauPtr tableau(const StepView& step) const override;
  bool is_stiff() const override { return inner().is_stiff(); }
  void restart_stiffness_test() override { inner().restart_stiffness_test(); }

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  struct Use {
    Subsystem part;
    std::shared_ptr<Stepper> stepper;
  };
  Stepper& inner() const { return *uses_.back().stepper; }
  void enter(int count, const Point& from, double dt, double end);
  StepView view(const Use& use, const StepView& step) const;

  std::shared_ptr<const DependencyGraph> couplings_;
  Make make_;
  Point rest_;
  std::vector<int> order_;
  int count_ = 0;
  std::vector<Use> uses_;  ///< indexed by step records
};

}  // namespace pendula::integrate
