// The families of adaptive methods, one row each, and the choice among them.
#pragma once

#include <span>
#include <string_view>

#include "integrate/plan/plan.hpp"
#include "integrate/problem/active_subsystem.hpp"

namespace pendula::integrate {

/// The ingredients of a stepper.
struct StepperRequest {
  ProblemPtr problem;
  const Method& method;
  const Plan& plan;
  const Tolerances& tolerances;
  Stats& stats;
};

/// A row of families(). A new family is a file in integrate/step and a row here.
struct MethodFamily {
  std::string_view name;                ///< method = "radau"
  std::vector<std::string_view> alias;  ///< other names for it
  std::string_view text;                ///< one line, for methods()
  bool listed;                          ///< has a name a user gives; else a tableau stands for it
  bool is_explicit;                     ///< x′ and z must follow from (t, x)
  bool one_step;                        ///< can go on with another part of a large model after every step
  std::string_view instead;             ///< what to write where steps are fixed
  std::string_view default_method;      ///< of the library `rosenbrock`, where the name stands for one of it
  /// Throws Error naming the method when it cannot treat the model, with one that can.
  std::shared_ptr<Stepper> (*make)(const StepperRequest&);
  /// Why its algebraic variables would not converge for a model of index 2 or 3 as
  /// it stands; "" where they do.
  std::string (*objection_to_index_2)(const Method&);
  int order = 0;  ///< 0: it varies, or belongs to the tableau
};

namespace family {
extern const MethodFamily explicit_pair, collocation, radau, bdf, rosenbrock, chebyshev;
}
std::span<const MethodFamily* const> families();
/// By name or alias; none: null.
const MethodFamily* family_named(std::string_view name);

/// Adaptive, and with fixed steps.
Method method_of(TableauPtr tableau);
Method method_of(RosenbrockPtr method);
/// The tableau's or Rosenbrock method's own name, else that of the family.
std::string name_of(const Method& method);

/// The stepper of a family. couplings: of a large model; implicit one-step methods
/// then integrate its active part.
std::shared_ptr<Stepper> make_stepper(const MethodFamily& family, const ProblemPtr& problem,
                                      const Method& method, const Plan& plan, Stats& stats,
                                      const std::shared_ptr<const DependencyGraph>& couplings = nullptr);

/// The place in Method::explicit_choice of the pair for this relative tolerance (the last
/// entry there is for large models).
std::size_t explicit_choice_at(double rtol);

/// Cost of an implicit step relative to one with few unknowns; grows because LU factorisations
/// scale worse than compiled explicit steps. Measured: docs/performance.md.
double implicit_cost(int unknowns);

/// So many explicit steps cost as much as a run of this implicit method over an interval in which a
/// small model has nothing but stiffness: some 30 steps of a Rosenbrock method, 15 of Radau IIA.
/// Measured: docs/performance.md.
double worth_explicit_steps(const MethodFamily& implicit, int unknowns);

/// The implicit family that "auto" takes for a stiff model: Radau IIA, or Rosenbrock where that is faster.
const MethodFamily& implicit_family(const Problem& problem, const Method& method, const Plan& plan);

/// Whether Radau IIA takes less work than a Rosenbrock method where steps are many and alike. Measured:
/// docs/performance.md.
bool raising_order_pays(const Plan& plan);

/// The counted work (step_work.hpp) of a step of an implicit method and of the explicit pair, whose steps
/// stability limits. Without a family: not counted.
struct StepCosts {
  const MethodFamily* family = nullptr;
  double implicit_step = 0, explicit_step = 0;
  double usual_steps = 0;  ///< of the implicit method over an interval
  double worth_explicit_steps() const { return usual_steps * implicit_step / explicit_step; }
};

/// The first method of "auto" for a model, its tolerances and a start.
struct Choice {
  const MethodFamily* family = nullptr;
  TableauPtr tableau;
  std::string why;  ///< in words, for stats()
  StepCosts costs{};
};
Choice choose(const ProblemPtr& problem, const Method& method, const Plan& plan, const Point& start,
              const std::shared_ptr<const DependencyGraph>& couplings = nullptr);

/// The explicit pair that "auto" takes for these tolerances.
TableauPtr explicit_pair_for(const Method& method, const Plan& plan);
/// A step of that pair where implicit steps are counted by passes over the nonzeros of the equations.
struct ExplicitWork {
  double step = 1;          ///< evaluations, and more where every stage solves for z or iterates
  bool costs_more = false;  ///< in any case than an implicit step
};
ExplicitWork explicit_work(const ProblemPtr& problem, const Method& method, const Plan& plan);

}  // namespace pendula::integrate
