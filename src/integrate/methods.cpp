#include "integrate/methods.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/bdf_stepper.hpp"
#include "integrate/collocation.hpp"
#include "integrate/explicit_stepper.hpp"
#include "integrate/irk_stepper.hpp"
#include "integrate/rosenbrock_stepper.hpp"

namespace pendula::integrate {

std::shared_ptr<Stepper> make_stepper(const std::string& family, const ProblemPtr& problem,
                                      const Method& method, const Plan& plan, Stats& stats) {
  const StepLimits limits{plan.dt_first, plan.dt_max};
  const Tolerances& tolerances = plan.tolerances;
  if (family == "explicit" || (family == "tableau" && method.tableau->is_explicit()))
    return std::make_shared<ExplicitStepper>(problem, method.tableau, tolerances, limits, stats);
  if (family == "radau")
    return std::make_shared<IrkStepper>("radau", problem,
                                        std::vector{radau_formula(3), radau_formula(5), radau_formula(7)},
                                        plan.variable_index, tolerances, limits, stats);
  if (family == "bdf")
    return std::make_shared<BdfStepper>(problem, method.order > 0 ? method.order : 5, plan.variable_index,
                                        tolerances, limits, stats);
  if (family == "rodas")
    return std::make_shared<RosenbrockStepper>(problem, method.rosenbrock, tolerances, limits, stats);
  if (family == "tableau" || family == "gauss") {
    const TableauPtr tableau = method.tableau ? method.tableau : std::make_shared<const Tableau>(gauss(3));
    return std::make_shared<IrkStepper>(tableau->name(), problem,
                                        std::vector{std::make_shared<const IrkFormula>(tableau)},
                                        plan.variable_index, tolerances, limits, stats);
  }
  throw Error(text("unknown method '", family, "'"));
}

/// The largest |λ| of ∂f/∂x with negative real part, roughly: the norm of the Jacobian where x′ and z are
/// eliminated would cost more than it tells.
static double steepness(Problem& problem, const Point& at) {
  problem.place(at.t, at.x.data(), at.xdot.data(), at.z.data());
  const std::vector<double>& J = problem.jacobian();
  double largest = 0;
  for (std::size_t k = 0; k < J.size(); ++k)
    if (problem.pattern()[k].column < problem.n() && std::isfinite(J[k]))
      largest = std::max(largest, std::fabs(J[k]));
  return largest;
}

Choice choose(const ProblemPtr& problem, const Method& method, const Plan& plan, const Point& start) {
  if (method.tableau) return {"explicit", method.tableau};
  const double tightest = plan.tolerances.rtol.size() > 0 ? plan.tolerances.rtol.minCoeff() : 1e-6;
  const bool high_index =
      std::any_of(plan.variable_index.begin(), plan.variable_index.end(), [](int i) { return i > 1; });
  if (method.explicit_choice.empty() || high_index || problem->n() == 0) return {"radau", nullptr};
  if (!problem->is_ode()) {
    Stats unused;
    Derivative derivative(problem, unused);
    Vec xdot = start.xdot, z = start.z;
    if (!derivative(start.t, start.x.data(), xdot.data(), z.data()) || !derivative.is_regular())
      return {"radau", nullptr};
  }
  // So many steps of an explicit method would be needed for stability alone: do not even begin.
  if (steepness(*problem, start) * (plan.to - plan.from) > 1e5) return {"radau", nullptr};
  const std::size_t which = tightest > 2e-3 ? 0 : tightest > 1e-5 ? 1 : 2;
  return {"explicit", method.explicit_choice[std::min(which, method.explicit_choice.size() - 1)]};
}

}  // namespace pendula::integrate
