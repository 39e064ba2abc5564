// A solution with the model it came from: any expression of the model or of its lineage has values.
#pragma once

#include "dae/start/start.hpp"
#include "integrate/plan/plan.hpp"
#include "integrate/problem/sensitivity.hpp"
#include "integrate/solution/drift.hpp"

namespace pendula::integrate {

class Trajectory;

/// An event of one run, whose expressions contain leaves of the model.
struct ModelEvent : dae::Transition {
  /// Sees the solution so far, which ends at the event.
  std::function<EventReply(const std::shared_ptr<const Trajectory>&)> call;
};

class Trajectory {
 public:
  Trajectory(dae::ModelPtr model, Substitution inputs, SolutionPtr solution,
             std::vector<ModelEvent> events = {}, std::vector<Expr> asked = {},
             std::shared_ptr<const Variational> variational = nullptr,
             dae::ConsistentStatePtr start = nullptr)
      : model_(std::move(model)),
        inputs_(std::move(inputs)),
        solution_(std::move(solution)),
        events_(std::move(events)),
        asked_(std::move(asked)),
        variational_(std::move(variational)),
        start_(std::move(start)) {}

  const dae::ModelPtr& model() const { return model_; }
  const Solution& solution() const { return *solution_; }
  const dae::ConsistentStatePtr& start() const { return start_; }  ///< nullptr if there is none
  /// The expression of an event, for messages: as it was asked for.
  const std::vector<ModelEvent>& events() const { return events_; }

  /// One row per saved time, one column per expression; or the values at time t.
  /// Throws Error naming a symbol that is not of this model or its lineage.
  Mat values(std::span<const Expr> expressions) const;
  Vec values(std::span<const Expr> expressions, double t) const;

  /// The expressions in the unknowns and parameters of the solution, inputs put in.
  std::vector<Expr> resolved(std::span<const Expr> expressions) const;

  /// Parameters and initial values whose sensitivities were integrated.
  const std::vector<Expr>& sensitivities() const { return asked_; }
  /// d expression/dp for p in sensitivities(): one row per saved time, or at time t. Throws Error naming what
  /// was not asked for when the model was integrated.
  Mat sensitivity(std::span<const Expr> expressions, Expr p) const;
  Vec sensitivity(std::span<const Expr> expressions, Expr p, double t) const;

  /// d cost/dp at the end of the run by the discrete adjoint (adjoint.hpp), for parameters and for states
  /// that stand for their initial values. Needs no sensitivities. Throws Error where there is no adjoint.
  Vec gradient(Expr cost, const std::vector<Expr>& with_respect_to) const;

  /// Every constraint with the law of the model's form: a polynomial where the constraint was differentiated
  /// away, C = 0 where it is imposed.
  Drift drift() const;

 private:
  std::vector<Expr> differentiated(std::span<const Expr> expressions, Expr p) const;
  std::vector<Invariant> invariants() const;
  dae::ModelPtr model_;
  Substitution inputs_;
  SolutionPtr solution_;
  std::vector<ModelEvent> events_;
  std::vector<Expr> asked_;  ///< as the user named them
  std::shared_ptr<const Variational> variational_;
  dae::ConsistentStatePtr start_;
};

using TrajectoryPtr = std::shared_ptr<const Trajectory>;

}  // namespace pendula::integrate
