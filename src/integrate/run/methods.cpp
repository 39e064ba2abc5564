#include "integrate/run/methods.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/step/bdf_stepper.hpp"
#include "integrate/step/explicit_stepper.hpp"
#include "integrate/step/irk_stepper.hpp"
#include "integrate/step/rosenbrock_stepper.hpp"
#include "integrate/step/spectrum.hpp"
#include "integrate/step/subsystem_stepper.hpp"
#include "method/collocation.hpp"

namespace pendula::integrate {

namespace {

std::shared_ptr<Stepper> plain_stepper(const std::string& family, const ProblemPtr& problem,
                                       const Method& method, const Plan& plan, const Tolerances& tolerances,
                                       Stats& stats) {
  const StepLimits limits{plan.dt_first, plan.dt_max};
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

}  // namespace

std::shared_ptr<Stepper> make_stepper(const std::string& family, const ProblemPtr& problem,
                                      const Method& method, const Plan& plan, Stats& stats,
                                      const std::shared_ptr<const Couplings>& couplings) {
  if (!couplings || !plan.variable_index.empty() || (family != "radau" && family != "rodas"))
    return plain_stepper(family, problem, method, plan, plan.tolerances, stats);
  const auto make = [family, method, plan, &stats](const ProblemPtr& part, const Tolerances& tolerances) {
    return plain_stepper(family, part, method, plan, tolerances, stats);
  };
  return std::make_shared<PartStepper>(problem, couplings, make, plan.tolerances,
                                       StepLimits{plan.dt_first, plan.dt_max}, stats);
}

static double tightest(const Plan& plan) {
  return plan.tolerances.rtol.size() > 0 ? plan.tolerances.rtol.minCoeff() : 1e-6;
}

static bool has_high_index(const Plan& plan) {
  return std::any_of(plan.variable_index.begin(), plan.variable_index.end(), [](int i) { return i > 1; });
}

static bool contains_time(const Problem& problem) {
  if (!problem.model().u.empty()) return true;
  const std::vector<Expr> all = leaves(problem.model().F);
  return std::find(all.begin(), all.end(), time_symbol()) != all.end();
}

/// Of large sparse models the factorisations cost most: a Rosenbrock method takes one real matrix per step,
/// which pays unless the tolerance asks for the higher orders of Radau IIA. Of small ones it pays at loose
/// tolerances, unless the equations contain t: there its order drops to 2 (Hairer & Wanner II, §IV.15).
std::string implicit_family(const Problem& problem, const Method& method, const Plan& plan) {
  constexpr int large = 500;
  constexpr double loose = 5e-5, moderate = 0.99e-5;
  if (!method.rosenbrock || !problem.model().semi_explicit || has_high_index(plan)) return "radau";
  const double rtol = tightest(plan);
  const bool suits =
      problem.n() + problem.m() >= large ? rtol >= moderate : rtol >= loose && !contains_time(problem);
  return suits ? "rodas" : "radau";
}

namespace {

/// The same where some variable has moved by a hundredth of the largest: what is zero at the start, and with
/// it the eigenvalue of a reaction like y² (Robertson's), is not zero there any more.
std::optional<Rates> rates_ahead(Derivative& derivative, const Point& start, double span) {
  const double size = start.x.cwiseAbs().maxCoeff(), speed = start.xdot.cwiseAbs().maxCoeff();
  if (!(size > 0 && speed > 0)) return {};
  Point ahead = start;
  ahead.x += std::min(0.01 * size / speed, 0.01 * span) * start.xdot;
  if (!derivative(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data()) || !derivative.is_regular())
    return {};
  return rates(derivative, ahead);
}

/// Whether an implicit method would be faster from here on. An explicit one takes some |λ|T/5 steps for
/// stability alone, an implicit one a few dozen, each of which costs as much as 5 explicit steps for a
/// handful of unknowns, and 20 … 50 where there are many (brusselator, heat equation; docs/performance.md).
/// Where something grows nearly as fast as other things decay, accuracy asks for small steps anyway.
bool is_stiff(const Rates& rates, double span, int unknowns) {
  constexpr double many = 300, dominant = 4;
  return rates.damped * span > many * implicit_cost(unknowns) && rates.damped > dominant * rates.growing;
}

/// The problem whose eigenvalues are looked at: of a large model that is at rest almost everywhere, a part.
std::pair<ProblemPtr, Point> probed(const ProblemPtr& problem, const Point& start,
                                    const Couplings* couplings) {
  constexpr int enough = 500;
  if (!couplings) return {problem, start};
  int active = 0;
  const std::vector<int> order = couplings->order(*problem, start, active);
  const Part part(*couplings, problem, start, order,
                  active > 0 ? std::max(enough, 4 * active) : couplings->size());
  return {part.problem, part.take(start)};
}

}  // namespace

double implicit_cost(int unknowns) {
  constexpr double least = 15, most = 75;
  return std::clamp(unknowns / least, 1.0, most / least);
}

std::size_t explicit_rank(double rtol) { return rtol > 2e-3 ? 0 : rtol > 2e-4 ? 1 : rtol > 1e-9 ? 2 : 3; }

Choice choose(const ProblemPtr& whole, const Method& method, const Plan& plan, const Point& start,
              const std::shared_ptr<const Couplings>& couplings) {
  if (method.tableau) return {"explicit", method.tableau, ""};
  const double rtol = tightest(plan);
  if (method.explicit_choice.empty()) return {"radau", nullptr, ""};
  if (has_high_index(plan))
    return {"radau", nullptr, "the model has index 2 or more and is integrated as it stands"};
  if (whole->n() == 0) return {"radau", nullptr, "the model has no states"};
  Stats unused;
  auto [problem, at] = probed(whole, start, couplings.get());
  Derivative derivative(problem, unused);
  if (!derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()) || !derivative.is_regular())
    return {"radau", nullptr, "x′ and z do not follow from t and x at the start"};
  const auto here = rates(derivative, at);
  if (!here) return {"radau", nullptr, "no eigenvalues of ∂x′/∂x were found at the start"};
  const double span = plan.to - plan.from;
  const int size = problem->n() + problem->m();
  if (!problem->has_dense_jacobian()) {
    if (is_stiff(*here, span, size))
      return {implicit_family(*whole, method, plan), nullptr,
              "stiff: an eigenvalue of ∂x′/∂x at the start is large beside 1/(to - from)"};
    if (const auto later = rates_ahead(derivative, at, span); later && is_stiff(*later, span, size))
      return {implicit_family(*whole, method, plan), nullptr,
              "stiff: an eigenvalue of ∂x′/∂x soon becomes large beside 1/(to - from)"};
  }
  constexpr double oscillations = 300;
  if (problem->has_dense_jacobian() && method.explicit_choice.back() && here->fastest * span > oscillations &&
      rtol > 1e-11)
    return {"explicit", method.explicit_choice.back(),
            "explicit: fast oscillations limit the step, and this method is stable on the imaginary axis"};
  const std::size_t last = method.explicit_choice.size() - 1, which = std::min(explicit_rank(rtol), last);
  auto suits = method.explicit_choice.begin() + static_cast<std::ptrdiff_t>(which);
  if (!*suits)
    suits = std::find_if(method.explicit_choice.begin(), method.explicit_choice.end() - 1, std::identity());
  return {"explicit", *suits, "explicit: not stiff at the start, order for this tolerance"};
}

}  // namespace pendula::integrate
