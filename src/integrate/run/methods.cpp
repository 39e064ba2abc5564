#include "integrate/run/methods.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <functional>

#include "integrate/problem/per_equations.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/step_work.hpp"
#include "integrate/step/bdf_stepper.hpp"
#include "integrate/step/chebyshev_stepper.hpp"
#include "integrate/step/explicit_stepper.hpp"
#include "integrate/step/irk_stepper.hpp"
#include "integrate/step/rosenbrock_stepper.hpp"
#include "integrate/step/spectrum.hpp"
#include "integrate/step/subsystem_stepper.hpp"
#include "method/collocation.hpp"

namespace pendula::integrate {

namespace {

StepLimits limits(const Plan& plan) { return {plan.dt_first, plan.dt_max}; }

std::shared_ptr<Stepper> make_explicit(const StepperRequest& q) {
  return std::make_shared<ExplicitStepper>(q.problem, q.method.tableau, q.tolerances, limits(q.plan),
                                           q.stats);
}

std::shared_ptr<Stepper> make_collocation(const StepperRequest& q) {
  const TableauPtr tableau = q.method.tableau ? q.method.tableau : std::make_shared<const Tableau>(gauss(3));
  const std::vector formulas{std::make_shared<const IrkFormula>(tableau)};
  return std::make_shared<IrkStepper>(tableau->name(), q.problem, formulas, q.plan.variable_index,
                                      q.tolerances, limits(q.plan), q.stats);
}

std::shared_ptr<Stepper> make_radau(const StepperRequest& q) {
  const std::vector formulas{radau_formula(3), radau_formula(5), radau_formula(7)};
  return std::make_shared<IrkStepper>("radau", q.problem, formulas, q.plan.variable_index, q.tolerances,
                                      limits(q.plan), q.stats);
}

std::shared_ptr<Stepper> make_bdf(const StepperRequest& q) {
  return std::make_shared<BdfStepper>(q.problem, q.method.order > 0 ? q.method.order : 5,
                                      q.plan.variable_index, q.tolerances, limits(q.plan), q.stats);
}

std::shared_ptr<Stepper> make_rosenbrock(const StepperRequest& q) {
  return std::make_shared<RosenbrockStepper>(q.problem, q.method.rosenbrock, q.tolerances, limits(q.plan),
                                             q.stats);
}

std::shared_ptr<Stepper> make_chebyshev(const StepperRequest& q) {
  return std::make_shared<ChebyshevStepper>(q.problem, q.tolerances, limits(q.plan), q.stats);
}

std::string none(const Method&) { return ""; }
std::string needs_x_and_z(const Method&) { return "is explicit and needs x′ and z from the equations"; }

}  // namespace

namespace family {

const MethodFamily explicit_pair{.name = "explicit",
                                 .alias = {},
                                 .text = "explicit Runge-Kutta pairs, for equations that are not stiff",
                                 .listed = false,
                                 .is_explicit = true,
                                 .one_step = false,
                                 .instead = "rk.rk4",
                                 .default_method = "",
                                 .make = make_explicit,
                                 .objection_to_index_2 = needs_x_and_z};

const MethodFamily collocation{
    .name = "gauss",
    .alias = {},
    .text = "collocation, by default Gauss of order 6: symmetric, keeps quadratic invariants",
    .listed = true,
    .is_explicit = false,
    .one_step = false,
    .instead = "rk.gauss(3)",
    .default_method = "",
    .make = make_collocation,
    .objection_to_index_2 = [](const Method& method) -> std::string {
      if (method.tableau && method.tableau->is_stiffly_accurate()) return "";
      return "is not stiffly accurate: its algebraic variables do not converge in general";
    }};

const MethodFamily radau{.name = "radau",
                         .alias = {"radau5", "radauIIA"},
                         .text = "Radau IIA of order 5, 9 and 13, for stiff models and every index up to 3",
                         .listed = true,
                         .is_explicit = false,
                         .one_step = true,
                         .instead = "rk.radau(3)",
                         .default_method = "",
                         .make = make_radau,
                         .objection_to_index_2 = none};

const MethodFamily bdf{
    .name = "bdf",
    .alias = {},
    .text = "backward differentiation formulas of order 1 to 5, for large stiff models and few digits",
    .listed = true,
    .is_explicit = false,
    .one_step = false,
    .instead = "bdf(3)",
    .default_method = "",
    .make = make_bdf,
    .objection_to_index_2 = none};

const MethodFamily rosenbrock{
    .name = "rodas",
    .alias = {"rosenbrock"},
    .text = "Rosenbrock methods for M x′ = f with a constant M, for stiff models and few digits",
    .listed = true,
    .is_explicit = false,
    .one_step = true,
    .instead = "rk.radau(3)",
    .default_method = "rodas4",
    .make = make_rosenbrock,
    .objection_to_index_2 = [](const Method&) -> std::string { return "is for index 0 and 1"; }};

const MethodFamily chebyshev{
    .name = "rkc",
    .alias = {},
    .text =
        "Runge-Kutta-Chebyshev of order 2, explicit with many stages, for diffusion on grids and few digits",
    .listed = true,
    .is_explicit = true,
    .one_step = false,
    .instead = "rk.rk4",
    .default_method = "",
    .make = make_chebyshev,
    .objection_to_index_2 = needs_x_and_z,
    .order = 2};

}  // namespace family

std::span<const MethodFamily* const> families() {
  static constexpr const MethodFamily* all[] = {&family::explicit_pair, &family::radau,
                                                &family::collocation,   &family::bdf,
                                                &family::rosenbrock,    &family::chebyshev};
  return all;
}

const MethodFamily* family_named(std::string_view name) {
  for (const MethodFamily* row : families())
    if (row->name == name || std::find(row->alias.begin(), row->alias.end(), name) != row->alias.end())
      return row;
  return nullptr;
}

Method method_of(TableauPtr tableau) {
  Method method;
  method.family = tableau->is_explicit() ? &family::explicit_pair : &family::collocation;
  method.tableau = std::move(tableau);
  return method;
}

Method method_of(RosenbrockPtr rosenbrock) {
  Method method;
  method.family = &family::rosenbrock;
  method.rosenbrock = std::move(rosenbrock);
  return method;
}

std::string name_of(const Method& method) {
  if (method.tableau) return method.tableau->name();
  if (method.family && method.rosenbrock) return method.rosenbrock->name();
  return std::string(method.family ? method.family->name : "auto");
}

std::shared_ptr<Stepper> make_stepper(const MethodFamily& family, const ProblemPtr& problem,
                                      const Method& method, const Plan& plan, Stats& stats,
                                      const std::shared_ptr<const DependencyGraph>& couplings) {
  if (!couplings || !plan.variable_index.empty() || !family.one_step)
    return family.make({problem, method, plan, plan.tolerances, stats});
  const auto make = [&family, method, plan, &stats](const ProblemPtr& part, const Tolerances& tolerances) {
    return family.make({part, method, plan, tolerances, stats});
  };
  return std::make_shared<SubsystemStepper>(problem, couplings, make, plan.tolerances, limits(plan), stats);
}

static double tightest(const Plan& plan) {
  return plan.tolerances.rtol.size() > 0 ? plan.tolerances.rtol.minCoeff() : default_rtol;
}

static bool has_high_index(const Plan& plan) {
  return std::any_of(plan.variable_index.begin(), plan.variable_index.end(), [](int i) { return i > 1; });
}

/// Cost of an implicit step in explicit steps, for a handful of unknowns. Measured: docs/performance.md.
static double cost_of_step(const MethodFamily& implicit) {
  return &implicit == &family::rosenbrock ? 1.7 : 5;
}
constexpr double iterating = 5;  // factor where every stage iterates for z

/// Rosenbrock methods, with one real matrix per step, pay unless the tolerance calls for the higher orders of
/// Radau IIA. The limit is somewhat tighter for large models, whose factorisations dominate. Measured:
/// docs/performance.md. For equations that contain t the order of rodas4 drops to 2 (Hairer & Wanner II,
/// §IV.15), and in models of moderate size the additional steps cost more than the matrices save; small
/// models use rodas5p.
const MethodFamily& implicit_family(const Problem& problem, const Method& method, const Plan& plan) {
  constexpr int large = 500;
  constexpr double loose = 2e-5, moderate = 0.99e-5;
  if (!method.rosenbrock || !problem.model().semi_explicit || has_high_index(plan)) return family::radau;
  const double rtol = tightest(plan);
  const int unknowns = problem.n() + problem.m();
  const bool suits = unknowns <= StepWork::small
                         ? rtol >= loose
                         : rtol >= moderate && (unknowns >= large || !contains_time(problem));
  return suits ? family::rosenbrock : family::radau;
}

bool raising_order_pays(const Plan& plan) { return tightest(plan) < 2e-4; }

double worth_explicit_steps(const MethodFamily& implicit, int unknowns) {
  const double fewest = &implicit == &family::rosenbrock ? 30 : 15;
  return fewest * cost_of_step(implicit) * implicit_cost(unknowns);
}

namespace {

/// The rates at a point where some variable has changed by a hundredth of the largest. Species that are zero
/// at the start hide the stiff eigenvalue of a reaction like y² (Robertson's) and show it a little later.
std::optional<Rates> rates_ahead(RhsSolver& derivative, const Point& start, double span, double harmless) {
  const double size = start.x.cwiseAbs().maxCoeff(), speed = start.xdot.cwiseAbs().maxCoeff();
  if (!(size > 0 && speed > 0)) return {};
  Point ahead = start;
  constexpr double hundredth = 0.01;  // of the sizes, and of the interval
  ahead.x += std::min(hundredth * size / speed, hundredth * span) * start.xdot;
  if (!derivative(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data()) || !derivative.is_regular())
    return {};
  return rates(derivative, ahead, harmless);
}

/// Would an implicit method be faster from here on? Where something grows nearly as fast as other components
/// decay, accuracy requires small steps anyway. worth: number of explicit steps, limited by stability, up to
/// which the explicit method is kept. iterates: every evaluation of x′ iterates for z, so that an explicit
/// stage costs as much as an implicit one.
bool is_stiff(const Rates& rates, double span, double worth, bool iterates) {
  constexpr double dominant = 4;
  const double steps = rates.damped * span / stability_limit;
  return steps > (iterates ? worth / iterating : worth) && rates.damped > dominant * rates.growing;
}

/// Does a large model have modes so fast that resolving them takes very many steps: 2400/6 = 400 at the
/// limit of stability per unit of implicit_cost()? If these modes turn out to be excited, the implicit steps
/// become short and the method is changed, at a price that is small compared with 400 steps. Chosen on a
/// beam of 40 pieces (docs/performance.md).
bool swings_fast(const Rates& rates, double span, int unknowns) {
  constexpr double many = 2400, dominant = 1.5;
  return unknowns > StepWork::small && rates.fastest * span > many * implicit_cost(unknowns) &&
         rates.fastest > dominant * rates.growing;
}

/// Are the eigenvalues those of diffusion, for which Chebyshev methods are stable, and is the Jacobian nearly
/// symmetric, so that the eigenvalues determine the growth of errors?
bool is_diffusion(Problem& problem, const Rates& rates, const Point& at) {
  // Eigenvalues with |λ| ≤ 1.05 |Re λ| are within 18° of the negative axis, along which the damped region of
  // stability is a strip.
  constexpr double real = 1.05, shrinking = 0.01, normal = 0.01;
  if (rates.fastest > real * rates.damped || rates.growing > shrinking * rates.damped) return false;
  const int n = problem.n();
  problem.set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
  const std::vector<double>& values = problem.jacobian();
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < problem.pattern().size(); ++k)
    if (const auto e = problem.pattern()[k]; e.column < n) entries.emplace_back(e.row, e.column, values[k]);
  Eigen::SparseMatrix<double> J(n, n);
  J.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> transposed = J.transpose();
  return (J - transposed).norm() <= normal * J.norm();
}

/// The implicit method with the least work on a large model over an interval of usual difficulty. BDF, with
/// few factorisations, all of them real, competes for few digits only, since its errors are somewhat larger.
/// Rosenbrock methods compete for loose tolerances: from 10⁻⁵ on rodas4 takes up to eight times as many steps
/// as Radau IIA, most of them after fronts.
StepCosts cheapest_implicit(const Problem& problem, const Method& method, const Plan& plan,
                            const StepWork& work) {
  constexpr double few_digits = 5e-5, loose = 2e-5;
  // bdf errors are half a digit larger, which costs 3.7^0.2 of usual_bdf_steps()
  constexpr double clearly = 1.3;
  const double rtol = tightest(plan);
  StepCosts costs{&family::radau, work.radau_step(rtol), 0, usual_radau_steps(rtol)};
  if (rtol >= loose && &implicit_family(problem, method, plan) == &family::rosenbrock)
    costs = {&family::rosenbrock, work.rosenbrock_step(), 0, usual_rosenbrock_steps(rtol)};
  const double steps = usual_bdf_steps(rtol);
  if (rtol >= few_digits && clearly * steps * work.bdf_step() < costs.usual_steps * costs.implicit_step)
    costs = {&family::bdf, work.bdf_step(), 0, steps};
  return costs;
}

/// Chooses the method for a large model on which stability would force many explicit steps, by an estimate of
/// the work of each method.
std::optional<Choice> counted_choice(Problem& problem, const Method& method, const Plan& plan,
                                     const Point& start, const Rates& rates, double span) {
  constexpr double many = 25, dominant = 4, loosest_digits = 0.99e-5;
  // rkc is a digit less accurate, which costs 10^(1/3) times the steps at order 2
  constexpr double clearly = 2;
  constexpr int stages = 12;  // of dop853
  const double steps = rates.damped * span / stability_limit, rtol = tightest(plan);
  if (steps < many || rates.damped <= dominant * rates.growing) return {};
  const auto work = StepWork::of(problem);
  if (!work || !method.explicit_choice.back()) return {};
  StepCosts costs = cheapest_implicit(problem, method, plan, *work);
  costs.explicit_step = work->explicit_step(stages);
  const double explicit_run = steps * costs.explicit_step,
               implicit_run = costs.usual_steps * costs.implicit_step;
  if (rtol >= loosest_digits &&
      clearly * work->chebyshev_run(rates, span, rtol) < std::min(explicit_run, implicit_run) &&
      is_diffusion(problem, rates, start))
    return Choice{&family::chebyshev,
                  nullptr,
                  "stiff by diffusion: many stages cost less than factorisations for so few digits",
                  {}};
  if (implicit_run < explicit_run)
    return Choice{costs.family, nullptr,
                  "stiff: explicit steps as short as stability requires would cost more than implicit ones",
                  costs};
  return Choice{&family::explicit_pair, method.explicit_choice.back(),
                "explicit: stability limits the steps, and they cost less than implicit ones", costs};
}

/// The problem whose eigenvalues are computed. Of a large model that is at rest almost everywhere it is a
/// part, at most four times the part that moves at the start.
std::pair<ProblemPtr, Point> probed(const ProblemPtr& problem, const Point& start,
                                    const DependencyGraph* couplings) {
  constexpr int enough = 500;
  if (!couplings) return {problem, start};
  int active = 0;
  const std::vector<int> order = couplings->order(*problem, start, active);
  const Subsystem part(*couplings, problem, start, order,
                       active > 0 ? std::max(enough, 4 * active) : couplings->size());
  return {part.problem, part.take(start)};
}

}  // namespace

/// The pair for this relative tolerance.
static TableauPtr explicit_pair_for(const Method& method, double rtol) {
  const std::size_t last = method.explicit_choice.size() - 1,
                    which = std::min(explicit_choice_at(rtol), last);
  auto suits = method.explicit_choice.begin() + static_cast<std::ptrdiff_t>(which);
  if (!*suits)
    suits = std::find_if(method.explicit_choice.begin(), method.explicit_choice.end() - 1, std::identity());
  return *suits;
}

TableauPtr explicit_pair_for(const Method& method, const Plan& plan) {
  return explicit_pair_for(method, tightest(plan));
}

double implicit_cost(int unknowns) {
  constexpr double least = 15, most = 75;
  return std::clamp(unknowns / least, 1.0, most / least);
}

std::size_t explicit_choice_at(double rtol) { return rtol > 1e-9 ? 0 : 1; }

Choice choose(const ProblemPtr& whole, const Method& method, const Plan& plan, const Point& start,
              const std::shared_ptr<const DependencyGraph>& couplings) {
  if (method.tableau) return {&family::explicit_pair, method.tableau, ""};
  const double rtol = tightest(plan);
  if (method.explicit_choice.empty()) return {&family::radau, nullptr, ""};
  if (has_high_index(plan))
    return {&family::radau, nullptr, "the model has index 2 or more and is integrated as it stands"};
  if (whole->n() == 0) return {&family::radau, nullptr, "the model has no states"};
  Stats unused;
  auto [problem, at] = probed(whole, start, couplings.get());
  RhsSolver derivative(problem, unused);
  if (!derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()) || !derivative.is_regular())
    return {&family::radau, nullptr, "x′ and z do not follow from t and x at the start"};
  const double span = plan.to - plan.from;
  const int size = problem->n() + problem->m();
  // with modes few iterations are needed: branches are often linear
  const bool iterates = !derivative.is_linear() && plan.modes == 0;
  const MethodFamily& implicit = implicit_family(*whole, method, plan);
  const double worth = worth_explicit_steps(implicit, size);
  // the only criterion
  const bool stiffness_alone = size <= StepWork::small && !problem->has_dense_jacobian();
  const double harmless = stiffness_alone ? stability_limit * worth / (iterates ? iterating : 1) / span : 0;
  const auto here = rates(derivative, at, harmless);
  if (!here) return {&family::radau, nullptr, "no eigenvalues of ∂x′/∂x were found at the start"};
  if (!problem->has_dense_jacobian()) {
    if (!couplings)
      if (const auto counted = counted_choice(*whole, method, plan, at, *here, span)) return *counted;
    if (is_stiff(*here, span, worth, iterates))
      return {&implicit, nullptr,
              "stiff: an eigenvalue of ∂x′/∂x at the start is large compared with 1/(to - from)"};
    if (const auto later = rates_ahead(derivative, at, span, harmless);
        later && is_stiff(*later, span, worth, iterates))
      return {&implicit, nullptr,
              "stiff: an eigenvalue of ∂x′/∂x soon becomes large compared with 1/(to - from)"};
    if (iterates && iterated_stages_cost_more(size))
      return {&implicit, nullptr,
              "z is iterated for in every stage of an explicit step, which costs more than an implicit one"};
    if (swings_fast(*here, span, size))
      return {&implicit, nullptr, "oscillations far faster than the interval is long, which may be at rest"};
  }
  constexpr double oscillations = 300;  // in radians over the interval, some fifty periods
  if (problem->has_dense_jacobian() && method.explicit_choice.back() && here->fastest * span > oscillations &&
      rtol > 1e-11)
    return {&family::explicit_pair, method.explicit_choice.back(),
            "explicit: fast oscillations limit the step, and this method is stable on the imaginary axis"};
  return {&family::explicit_pair, explicit_pair_for(method, rtol),
          "explicit: not stiff at the start, order for this tolerance"};
}

ExplicitWork explicit_work(const ProblemPtr& problem, const Method& method, const Plan& plan) {
  if (method.explicit_choice.empty()) return {};
  const double stages = explicit_pair_for(method, plan)->stages();
  if (problem->is_ode()) return {stages};
  constexpr double solving = 2, factorising = 4;  // cost in passes
  Stats unused;
  const RhsSolver derivative(problem, unused);
  if (derivative.is_linear()) return {(derivative.has_constant_matrix() ? solving : factorising) * stages};
  const bool is_chosen = plan.modes > 0;  // as by choose(): what it costs is measured then
  return {iterating * stages, !is_chosen && iterated_stages_cost_more(problem->n() + problem->m())};
}

}  // namespace pendula::integrate
