#include "integrate/methods.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/collocation.hpp"
#include "integrate/explicit_stepper.hpp"
#include "integrate/irk_stepper.hpp"

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
  if (family == "tableau" || family == "gauss") {
    const TableauPtr tableau = method.tableau ? method.tableau : std::make_shared<const Tableau>(gauss(3));
    return std::make_shared<IrkStepper>(tableau->name(), problem,
                                        std::vector{std::make_shared<const IrkFormula>(tableau)},
                                        plan.variable_index, tolerances, limits, stats);
  }
  throw Error(text("unknown method '", family, "'"));
}

Choice choose(const ProblemPtr& problem, const Method& method, const Plan& plan, const Point& start) {
  (void)problem, (void)plan, (void)start;
  if (method.tableau) return {"explicit", method.tableau};
  return {"explicit", method.explicit_choice[1]};
}

}  // namespace pendula::integrate
