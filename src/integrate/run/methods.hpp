// The families of adaptive methods, one line each.
#pragma once

#include "integrate/problem/active_subsystem.hpp"
#include "integrate/run/plan.hpp"

namespace pendula::integrate {

/// The stepper for a family ("explicit", "radau", …). Throws Error naming the method when it cannot treat the
/// model, with one that can. couplings: of a large model, of which implicit one-step methods then integrate
/// the active part.
std::shared_ptr<Stepper> make_stepper(const std::string& family, const ProblemPtr& problem,
                                      const Method& method, const Plan& plan, Stats& stats,
                                      const std::shared_ptr<const Couplings>& couplings = nullptr);

/// Which of Method::explicit_choice "auto" takes at this relative tolerance; the last one is for large
/// models.
std::size_t explicit_rank(double rtol);

/// Of a step, in units of the cost for a handful of unknowns (some 5 explicit steps): factorisations do not
/// keep up with whole explicit steps in machine code.
double implicit_cost(int unknowns);

/// The implicit family that "auto" takes for a stiff model: "radau", or "rodas" where that is faster.
std::string implicit_family(const Problem& problem, const Method& method, const Plan& plan);

/// What "auto" begins with for a model and its tolerances, at a start.
struct Choice {
  std::string family;
  TableauPtr tableau;
  std::string why;  ///< in words, for stats()
};
Choice choose(const ProblemPtr& problem, const Method& method, const Plan& plan, const Point& start,
              const std::shared_ptr<const Couplings>& couplings = nullptr);

}  // namespace pendula::integrate
