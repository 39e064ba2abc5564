#include "integrate/methods.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/bdf_stepper.hpp"
#include "integrate/collocation.hpp"
#include "integrate/derivative.hpp"
#include "integrate/explicit_stepper.hpp"
#include "integrate/irk_stepper.hpp"
#include "integrate/part_stepper.hpp"
#include "integrate/rosenbrock_stepper.hpp"

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

namespace {

struct Eigenvalue {
  double size = 0;       ///< |λ|
  double real_part = 0;  ///< negative: damped
};

/// The eigenvalue of ∂x′/∂x of largest size, roughly: a power iteration whose products with the Jacobian are
/// differences of x′, as in Sommeijer, Shampine & Verwer, RKC: An explicit solver for parabolic PDEs, J.
/// Comput. Appl. Math. 88, 1998, §3; a pair λ, λ̄ shows in three vectors in a row, u₂ = a u₁ + b u₀.
class PowerIteration {
 public:
  PowerIteration(Derivative& derivative, const Point& at)
      : derivative_(derivative), at_(at), scale_(at.x.cwiseAbs()) {
    const double largest = scale_.maxCoeff();
    scale_.array() += largest > 0 ? 1e-3 * largest : 1;
  }

  /// Nothing where x′ cannot be evaluated near the start.
  std::optional<Eigenvalue> run() {
    constexpr int most = 16;
    Vec u0(at_.x.size());
    for (Eigen::Index i = 0; i < u0.size(); ++i) u0[i] = 1 + 0.5 * std::cos(1.7 * static_cast<double>(i));
    Eigenvalue last;
    auto u1 = product(u0.normalized());
    u0.normalize();
    for (int k = 0; k < most && u1; ++k) {
      const double growth = u1->norm();
      if (growth == 0) return Eigenvalue{};
      const auto u2 = product(*u1 / growth);
      if (!u2) return {};
      const Eigenvalue now = dominant(u0, *u1, *u2 * growth);
      if (k > 2 && std::fabs(now.size - last.size) < 0.05 * now.size) return now;
      last = now;
      u0 = *u1 / growth, u1 = u2;
    }
    return u1 ? std::optional(last) : std::nullopt;
  }

 private:
  /// J v in units of the scales.
  std::optional<Vec> product(const Vec& v) {
    constexpr double step = 1e-7;
    const Vec x = at_.x + step * scale_.cwiseProduct(v);
    Vec xdot = at_.xdot, z = at_.z;
    if (!derivative_(at_.t, x.data(), xdot.data(), z.data())) return {};
    return Vec((xdot - at_.xdot).cwiseQuotient(scale_) / step);
  }
  static Eigenvalue dominant(const Vec& u0, const Vec& u1, const Vec& u2) {
    const double a00 = u0.dot(u0), a01 = u0.dot(u1), a11 = u1.dot(u1), b0 = u0.dot(u2), b1 = u1.dot(u2);
    const double determinant = a00 * a11 - a01 * a01;
    if (determinant <= 1e-10 * a00 * a11) return {std::fabs(a01 / a00), a01 / a00};  // u₁ = λ u₀
    const double a = (a00 * b1 - a01 * b0) / determinant, b = (a11 * b0 - a01 * b1) / determinant;
    const double discriminant = a * a / 4 + b;
    if (discriminant < 0) return {std::sqrt(-b), a / 2};
    const double root = a / 2 + std::copysign(std::sqrt(discriminant), a);
    return {std::fabs(root), root};
  }
  Derivative& derivative_;
  const Point& at_;
  Vec scale_;
};

}  // namespace

/// Of large sparse models the factorisations cost most: a Rosenbrock method takes one real matrix per step,
/// which pays unless the tolerance asks for the higher orders of Radau IIA.
static Choice implicit_choice(const Problem& problem, const Method& method, double tightest,
                              const char* why) {
  constexpr int large = 500;
  const bool suits = method.rosenbrock && problem.model().semi_explicit && problem.n() + problem.m() >= large;
  return {suits && tightest >= 0.99e-6 ? "rodas" : "radau", nullptr, why};
}

namespace {

/// The same where some variable has moved by a hundredth of the largest: what is zero at the start, and with
/// it the eigenvalue of a reaction like y² (Robertson's), is not zero there any more.
std::optional<Eigenvalue> eigenvalue_ahead(Derivative& derivative, const Point& start, double span) {
  const double size = start.x.cwiseAbs().maxCoeff(), speed = start.xdot.cwiseAbs().maxCoeff();
  if (!(size > 0 && speed > 0)) return {};
  Point ahead = start;
  ahead.x += std::min(0.01 * size / speed, 0.01 * span) * start.xdot;
  if (!derivative(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data()) || !derivative.is_regular())
    return {};
  return PowerIteration(derivative, ahead).run();
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

Choice choose(const ProblemPtr& whole, const Method& method, const Plan& plan, const Point& start,
              const std::shared_ptr<const Couplings>& couplings) {
  if (method.tableau) return {"explicit", method.tableau, ""};
  const double tightest = plan.tolerances.rtol.size() > 0 ? plan.tolerances.rtol.minCoeff() : 1e-6;
  const bool high_index =
      std::any_of(plan.variable_index.begin(), plan.variable_index.end(), [](int i) { return i > 1; });
  if (method.explicit_choice.empty()) return {"radau", nullptr, ""};
  if (high_index) return {"radau", nullptr, "the model has index 2 or more and is integrated as it stands"};
  if (whole->n() == 0) return {"radau", nullptr, "the model has no states"};
  Stats unused;
  auto [problem, at] = probed(whole, start, couplings.get());
  Derivative derivative(problem, unused);
  if (!derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()) || !derivative.is_regular())
    return {"radau", nullptr, "x′ and z do not follow from t and x at the start"};
  const auto eigenvalue = PowerIteration(derivative, at).run();
  if (!eigenvalue) return {"radau", nullptr, "x′ cannot be computed near the start"};
  // An explicit method would take some |λ|T/5 steps for stability alone; an implicit one a few dozen.
  constexpr double many = 300;
  const double span = plan.to - plan.from;
  const auto stiff = [&](const Eigenvalue& e) { return e.real_part < -0.5 * e.size && e.size * span > many; };
  if (!problem->has_dense_jacobian()) {
    if (stiff(*eigenvalue))
      return implicit_choice(*whole, method, tightest,
                             "stiff: an eigenvalue of ∂x′/∂x at the start is large beside 1/(to - from)");
    if (const auto later = eigenvalue_ahead(derivative, at, span); later && stiff(*later))
      return implicit_choice(*whole, method, tightest,
                             "stiff: an eigenvalue of ∂x′/∂x soon becomes large beside 1/(to - from)");
  }
  if (problem->has_dense_jacobian() && eigenvalue->size * span > many && tightest > 1e-11)
    return {"explicit", method.explicit_choice.back(),
            "explicit: fast oscillations limit the step, and this method is stable on the imaginary axis"};
  const std::size_t which = tightest > 2e-3 ? 0 : tightest > 2e-4 ? 1 : tightest > 1e-9 ? 2 : 3;
  return {"explicit", method.explicit_choice[std::min(which, method.explicit_choice.size() - 1)],
          "explicit: not stiff at the start, order for this tolerance"};
}

}  // namespace pendula::integrate
