// A solution in the words of the model it came from: any expression of the model or of its lineage has
// values.
#pragma once

#include "dae/start.hpp"
#include "integrate/drift.hpp"
#include "integrate/integrate.hpp"

namespace pendula::integrate {

struct Simulation {
  dae::StartPtr start;              ///< of this model; x is taken from it, x′ and z as starting values
  dae::ParameterValues parameters;  ///< override those of the model
  Substitution inputs;              ///< input leaf (of any order) -> expression in t and parameters
  std::vector<std::pair<Expr, Problem::Input>> numeric_inputs;
  TableauPtr method;
  Plan plan;
};

class Trajectory {
 public:
  Trajectory(dae::ModelPtr model, Substitution inputs, SolutionPtr solution)
      : model_(std::move(model)), inputs_(std::move(inputs)), solution_(std::move(solution)) {}

  const dae::ModelPtr& model() const { return model_; }
  const Solution& solution() const { return *solution_; }

  /// One row per saved time, one column per expression; or the values at time t.
  /// Throws Error naming a symbol that is not of this model or its lineage.
  Mat values(std::span<const Expr> expressions) const;
  Vec values(std::span<const Expr> expressions, double t) const;

  /// Every constraint with the law of the model's form: a polynomial where the constraint was differentiated
  /// away, C = 0 where it is imposed.
  Drift drift() const;

 private:
  std::vector<Expr> resolved(std::span<const Expr> expressions) const;
  std::vector<Invariant> invariants() const;
  dae::ModelPtr model_;
  Substitution inputs_;
  SolutionPtr solution_;
};

using TrajectoryPtr = std::shared_ptr<const Trajectory>;

/// Integrates a model.
/// Throws Error when the index is 2 or more (unless plan.direct), a parameter or an input has no value, the
/// derivative of an input that is only known as a function of numbers is needed; and whatever integrate()
/// throws.
TrajectoryPtr simulate(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
