// The engine: published numbers, exactness, observed order, invariants, two roads to the same answer.
#include <cmath>

#include <doctest/doctest.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "dae/model/first_order.hpp"
#include "method/collocation.hpp"
#include "tests/integrate/problems.hpp"

namespace pendula::runge_kutta_test {

using namespace pendula::test;

namespace {

Vec end_state(const dae::FirstOrder& model, const TableauPtr& rk, const Point& from, double to, double dt) {
  const SolutionPtr solution = integrate::integrate(problem(model), rk, from, plan(to, dt));
  CHECK(solution->status() == "finished");
  return solution->final().x;
}

double error_of(const Ivp& ivp, const TableauPtr& rk, double dt) {
  return (end_state(ivp.model, rk, ivp.start, ivp.to, dt) - ivp.solution(ivp.to)).cwiseAbs().maxCoeff();
}

std::vector<TableauPtr> methods() {
  std::vector<TableauPtr> list = {euler(), rk4(), implicit_euler(), trapezoid()};
  for (int s = 1; s <= 4; ++s) list.push_back(share(gauss(s)));
  for (int s = 2; s <= 3; ++s) list.push_back(share(radau(s)));
  return list;
}

Expr x() { return variable("x"); }

}  // namespace

TEST_CASE("engine: published end values of x' = -2x and of the Van der Pol oscillator") {
  const dae::FirstOrder decay = ode({x()}, {-2 * x()});
  const auto final = [&](const TableauPtr& rk) {
    return end_state(decay, rk, start(vector({1})), 2, 0.1)[0];
  };
  // 20 steps, each one rounding of a number that shrinks: the printed digits (16
  // decimals, 14 for Gauss) are exact.
  CHECK(std::fabs(final(euler()) - 0.0115292150460685) <= 5.1e-17);
  CHECK(std::fabs(final(drawn("0 | \n 1/2 | 1/2 \n | 0 1")) - 0.0188919613181312) <= 5.1e-17);
  CHECK(std::fabs(final(rk4()) - 0.0183167933693744) <= 5.1e-17);
  CHECK(std::fabs(final(share(gauss(2))) - 0.01831580208277) <= 5.1e-15);

  const Expr y = variable("y");
  const dae::FirstOrder van_der_pol = ode({x(), y}, {y, 5 * (1 - x() * x()) * y - x()});
  // Global errors of gauss(4) at dt = 0.005 and 0.01 agree to 1e-12; the reference is rounded at 5e-13.
  const Vec end = end_state(van_der_pol, share(gauss(4)), start(vector({2, 0})), 25, 0.005);
  CHECK(std::fabs(end[0] - 1.747561006961) <= 2e-12);
  CHECK(std::fabs(end[1] + 0.167270372278) <= 2e-12);
}

TEST_CASE("engine: the 3-D pendulum in index-1 form, fully implicit and semi-explicit") {
  const Vec reference = vector(
      {0.579251157202, 0.588246716733, -0.564299474688, 0.426250340232, 2.159236710359, 2.688412760251});
  for (const auto& model : {pendulum3d(), pendulum3d_semi_explicit()}) {
    // gauss(4), dt = 0.02: the method's error is below 1e-13 (halving dt does not change the digits);
    // reference 5e-13.
    const Vec end = end_state(model, share(gauss(4)), pendulum_start(), 2, 0.02);
    CHECK((end - reference).cwiseAbs().maxCoeff() <= 2e-12);
  }
  const Vec step_reference = vector({0.99380511106767, 0.09975339146509, -0.04897968173065, -0.14771301968379,
                                     0.99140678021318, -0.97799257963048});
  for (const auto& model : {pendulum3d(), pendulum3d_semi_explicit()}) {
    const Vec step = end_state(model, share(gauss(2)), pendulum_start(), 0.1, 0.1);
    CHECK((step - step_reference).cwiseAbs().maxCoeff() <= 1e-14);  // printed to 5e-15, solved to a few ε
  }
}

TEST_CASE("engine: an explicit method on an index-1 DAE is the method on the underlying ODE") {
  // Two roads: rk4 with (K, z) from F = 0 at every stage, and rk4 on x′ = f(x, z(x)).
  const dae::FirstOrder semi = pendulum3d_semi_explicit();
  const auto& q = semi.x;
  const Expr z = (q[3] * q[3] + q[4] * q[4] + q[5] * q[5] - Expr(9.81) * q[2]) /
                 (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
  const dae::FirstOrder explicit_ode =
      ode(q, {q[3], q[4], q[5], -z * q[0], -z * q[1], Expr(-9.81) - z * q[2]});
  const Vec by_ode = end_state(explicit_ode, rk4(), pendulum_start(), 1, 0.05);
  for (const auto& model : {pendulum3d(), semi, hidden(semi)}) {
    const Vec by_dae = end_state(model, rk4(), pendulum_start(), 1, 0.05);
    // 80 stages, each solved to some ε of numbers ≤ 30 and amplified by less than e^(L t) ≈ 20.
    CHECK((by_dae - by_ode).cwiseAbs().maxCoeff() <= 1e-12);
  }
}

TEST_CASE("engine: x' and z at every saved time satisfy the equations") {
  for (const TableauPtr& rk : {rk4(), share(gauss(2)), trapezoid()}) {
    const auto model = pendulum3d();
    const SolutionPtr solution = integrate::integrate(problem(model), rk, pendulum_start(), plan(1, 0.1));
    const Mat residual = solution->values(model.F);
    CHECK(residual.rows() == 11);
    CHECK(residual.cwiseAbs().maxCoeff() <= 4.3e-13);  // 32 ε of terms ≤ 60, where Newton may stop
  }
}

TEST_CASE("order: every method converges at its order, on nonlinear, non-autonomous and implicit problems") {
  for (const TableauPtr& rk : methods()) {
    for (const Ivp& ivp : smooth_problems()) {
      CAPTURE(rk->name());
      CAPTURE(ivp.name);
      // Steps so small that the leading term dominates, errors so large that rounding (1e-14) does not.
      const double dt = rk->order() <= 2 ? 1.0 / 64 : rk->order() <= 4 ? 1.0 / 16 : 1.0 / 4;
      const double coarse = error_of(ivp, rk, dt), fine = error_of(ivp, rk, dt / 2);
      const double slope = std::log2(coarse / fine);
      // One-sided: lucky cancellation may give more; an error of 1e-13 is exactness.
      CHECK((slope >= rk->order() - 0.25 || fine < 1e-13));
    }
  }
}

TEST_CASE("exactness: a method of order p integrates polynomials in t of degree p") {
  const Expr t = time_symbol();
  for (const TableauPtr& rk : methods()) {
    CAPTURE(rk->name());
    const int p = rk->order();
    const dae::FirstOrder model = ode({x()}, {Expr(p) * pow(t, Expr(p - 1))});
    const double end = end_state(model, rk, start(vector({0})), 2, 0.5)[0];
    CHECK(std::fabs(end / std::pow(2, p) - 1) <= 4e-15);  // 4 steps of ≤ 4 stages, a few ε each
  }
}

TEST_CASE("invariants: Gauss methods keep quadratic first integrals and are reversible") {
  // Euler's equations of a rigid body keep |w|² and w·Iw, both quadratic.
  const Expr a = variable("a"), b = variable("b"), c = variable("c");
  const Expr half = parse_number("1/2");
  const dae::FirstOrder body = ode({a, b, c}, {half * b * c, -a * c, half * a * b});
  const Point from = start(vector({0.8, 0.6, 0.3}));
  for (int s : {1, 2, 3}) {
    CAPTURE(s);
    const SolutionPtr solution = integrate::integrate(problem(body), share(gauss(s)), from, plan(100, 0.1));
    const Expr integrals[] = {a * a + b * b + c * c, a * a - c * c};
    const Mat values = solution->values(integrals);
    // 1000 steps, each adds rounding of a few ε that neither grows nor cancels: 1000 · 4 ε.
    CHECK((values.rowwise() - values.row(0)).cwiseAbs().maxCoeff() <= 1e-12);
  }
  // Reversible: integrating x′ = f, then x′ = -f over the same steps, is the identity (up to Newton's
  // rounding, 400 steps).
  const dae::FirstOrder back = ode({a, b, c}, {-half * b * c, a * c, -half * a * b});
  for (const TableauPtr& rk : {share(gauss(1)), share(gauss(2)), trapezoid()}) {
    const Vec there = end_state(body, rk, from, 20, 0.1);
    const Vec home = end_state(back, rk, start(there), 20, 0.1);
    CHECK((home - from.x).cwiseAbs().maxCoeff() <= 1e-12);
  }
}

TEST_CASE("engine: stiff components behave as R(∞) says") {
  const dae::FirstOrder stiff = ode({x()}, {Expr(-1000000) * (x() - cos(time_symbol()))});
  const Vec end = end_state(stiff, share(radau(3)), start(vector({1})), 1, 0.1);
  CHECK(std::fabs(end[0] - std::cos(1.0)) <= 1e-5);  // x - cos t = sin t/λ + …, |λ| = 10⁶
}

TEST_CASE("mesh: the last step is shortened, rounding adds no step, times do not change the mesh") {
  const dae::FirstOrder decay = ode({x()}, {-x()});
  const auto run = [&](const Plan& p) {
    return integrate::integrate(problem(decay), rk4(), start(vector({1})), p);
  };
  CHECK(run(plan(1, 0.1))->stats().steps == 10);
  CHECK(run(plan(1, 0.3))->stats().steps == 4);
  CHECK(run(plan(1, 0.3))->t().back() == 1);
  CHECK(run(plan(0.3, 0.1))->stats().steps == 3);
  CHECK(run(plan(0.1, 5))->stats().steps == 1);
  Plan shifted = plan(7.3, 0.1);
  shifted.from = 7;
  CHECK(run(shifted)->t().size() == 4);

  Plan selected = plan(1, 0.1);
  selected.times = {0.0, 0.25, 0.3, 1.0};
  const SolutionPtr few = run(selected), all = run(plan(1, 0.1));
  CHECK(few->t() == std::vector<double>{0, 0.25, 0.3, 1});
  CHECK(few->point(2).x == all->point(3).x);
  CHECK(few->final().x == all->final().x);
  CHECK(std::fabs(few->point(1).x[0] - std::exp(-0.25)) <= 1e-6);  // rk4's own error: (dt⁴/120) e^(-t)
}

TEST_CASE("dense: between saved times the method itself continues, outside is an error") {
  const auto model = pendulum3d();
  for (const TableauPtr& rk : {share(gauss(3)), rk4()}) {
    const SolutionPtr solution = integrate::integrate(problem(model), rk, pendulum_start(), plan(1, 0.05));
    const SolutionPtr exact =
        integrate::integrate(problem(model), share(gauss(6)), pendulum_start(), plan(1, 0.05));
    const auto error = [&](double t) { return (solution->at(t).x - exact->at(t).x).cwiseAbs().maxCoeff(); };
    // As accurate as the mesh around it, and more than cubic interpolation: t = 0.75 is a mesh point.
    CHECK(error(0.73) <= 1.5 * error(0.75));
    CHECK(solution->at(0.5).x == solution->point(10).x);
    CHECK(solution->at(1).x == solution->final().x);
    const Vec residual = solution->values(model.F, 0.73);
    CHECK(residual.cwiseAbs().maxCoeff() <= 4.3e-13);
  }
  const SolutionPtr solution = integrate::integrate(problem(model), rk4(), pendulum_start(), plan(1, 0.05));
  CHECK_THROWS_WITH_AS(solution->at(1.5), "t = 1.5 lies outside the solution, which covers 0 ≤ t ≤ 1", Error);
  CHECK_THROWS_AS(solution->at(std::nan("")), Error);
}

TEST_CASE("inputs and parameters reach the equations") {
  const Expr u = symbol(Kind::input, "u"), k = symbol(Kind::parameter, "k");
  dae::FirstOrder model = ode({x()}, {k * u});
  model.u = {u};
  model.p = {k};
  const auto make = [&](Problem::Input input) {
    return std::make_shared<Problem>(model, vector({3}), std::vector<Problem::Input>{std::move(input)});
  };
  const SolutionPtr solution = integrate::integrate(make([](double t) { return t * t; }), share(gauss(2)),
                                                    start(vector({0})), plan(2, 0.5));
  CHECK(std::fabs(solution->final().x[0] - 8) <= 8e-15);  // degree 3: exact but for rounding
  const Expr known[] = {u, k};
  CHECK(solution->values(known, 2.0) == vector({4, 3}));
  CHECK_THROWS_WITH_AS(Problem(model, vector({3})),
                       "the input u has no values; give inputs = { u = function(t) … end }", Error);
  CHECK_THROWS_WITH_AS(
      integrate::integrate(make([](double) { return NAN; }), rk4(), start(vector({0})), plan(1, 0.1)),
      "at the start, t = 0: the input u is nan at t = 0", Failure);
  const SolutionPtr gap = integrate::integrate(make([](double t) { return t < 0.5 ? 1 : NAN; }), rk4(),
                                               start(vector({0})), plan(1, 0.1));
  CHECK(gap->status() == "stopped at t = 0.4: the input u is nan at t = 0.5");
}

TEST_CASE("failures: blow-up stops with a status and keeps what was computed") {
  const dae::FirstOrder blow_up = ode({x()}, {x() * x()});
  for (const TableauPtr& rk :
       {euler(), rk4(), implicit_euler(), share(gauss(2)), share(radau(2)), share(gauss(5))}) {
    CAPTURE(rk->name());
    const SolutionPtr solution =
        integrate::integrate(problem(blow_up), rk, start(vector({1})), plan(3, 0.01));
    CAPTURE(solution->status());
    CHECK(solution->status().find("stopped at t = ") == 0);
    CHECK(solution->size() > 90);
    CHECK(solution->final().x.allFinite());
  }
  const SolutionPtr newton =
      integrate::integrate(problem(blow_up), implicit_euler(), start(vector({1})), plan(3, 0.1));
  CHECK(newton->status().find("Newton did not converge (dt = 0.1, ") != std::string::npos);
  CHECK(newton->status().find("worst: equation 1)") != std::string::npos);
}

TEST_CASE("failures: a model of index above 1 is refused by the names of its variables") {
  dae::FirstOrder index3 = pendulum3d();
  Expr C = -1;
  for (int i = 0; i < 3; ++i) C += index3.x[i] * index3.x[i];
  index3.F.back() = C / 2;
  index3.label.back() = "0 = (pᵀp - 1)/2";
  CHECK_THROWS_WITH_AS(
      integrate::integrate(problem(index3), share(gauss(2)), pendulum_start(), plan(1, 0.1)),
      "at the start, t = 0: the equations do not determine v1′, z (0 = (pᵀp - 1)/2 does not restrict them): "
      "the index is "
      "above 1, or this point is singular. Reduce the index first: sys:reduce():integrate{…}",
      Failure);
  // As it stands, Radau IIA converges on index 3 (z with order s - 1); explicit methods cannot.
  Plan direct = plan(0.1, 0.001);
  direct.direct = true;
  Point from = pendulum_start();
  from.xdot = vector({0, 1, 0, -1, 0, -9.81}), from.z = vector({1});
  const SolutionPtr solution = integrate::integrate(problem(index3), share(radau(3)), from, direct);
  const SolutionPtr reduced =
      integrate::integrate(problem(pendulum3d()), share(gauss(4)), pendulum_start(), plan(0.1, 0.01));
  CHECK(solution->status() == "finished");
  // Hairer & Wanner II, Table VII.4.1: velocities of order s = 3, multipliers of order
  // s - 1 = 2; constants below 100.
  CHECK((solution->final().x - reduced->final().x).cwiseAbs().maxCoeff() <= 1e-7);
  CHECK(std::fabs(solution->final().z[0] - reduced->final().z[0]) <= 1e-4);
  CHECK_THROWS_WITH_AS(integrate::integrate(problem(index3), rk4(), from, direct),
                       doctest::Contains("the method rk4 gives no z"), Error);
}

TEST_CASE("failures: bad plans are refused") {
  const auto refuse = [](Plan p) {
    const dae::FirstOrder decay = ode({x()}, {-x()});
    try {
      integrate::integrate(problem(decay), rk4(), start(vector({1})), p);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK(refuse(plan(1, 0)) == "dt = 0; the step must be a positive number, for example dt = 0.01");
  CHECK(refuse(plan(1, NAN)) == "dt = nan; the step must be a positive number, for example dt = 0.01");
  CHECK(refuse(plan(-1, 0.1)) == "to = -1 must be greater than from = 0");
  CHECK(refuse(plan(INFINITY, 0.1)) == "from and to must be finite numbers");
  CHECK(refuse(plan(1, 1e-300)) == "dt = 1e-300 is too small for an interval of 1");
  CHECK(refuse(plan(1, 1e-11)) ==
        "1e+11 steps are too many to save; give the times to keep, times = linspace(0, 1, 1001), "
        "or a larger dt");
  Plan p = plan(1, 0.1);
  p.times = {0.5, 0.2};
  CHECK(refuse(p) == "times must increase, but times[1] = 0.5 and times[2] = 0.2");
  p.times = {2.0};
  CHECK(refuse(p) == "times[1] = 2 lies outside 0 ≤ t ≤ 1");
  p.times = std::vector<double>();
  CHECK(refuse(p) == "times is empty; leave it out to save every step");
}

TEST_CASE("interrupts: Ctrl-C keeps the part that was computed") {
  const Expr u = symbol(Kind::input, "u");
  dae::FirstOrder model = ode({x()}, {u});
  model.u = {u};
  const auto input = [](double t) {
    if (t > 0.5) interrupt_requested = true;
    return 1.0;
  };
  const auto asked = std::make_shared<Problem>(model, Vec(), std::vector<Problem::Input>{input});
  const SolutionPtr solution = integrate::integrate(asked, rk4(), start(vector({0})), plan(1, 0.1));
  interrupt_requested = false;
  CHECK(solution->status() == "interrupted");
  CHECK(solution->size() == 7);
}

TEST_CASE("stats count what was done") {
  const dae::FirstOrder decay = ode({x()}, {-x()});
  const SolutionPtr by_rk4 = integrate::integrate(problem(decay), rk4(), start(vector({1})), plan(1, 0.1));
  CHECK(by_rk4->stats().evaluations ==
        41);  // x′ at the mesh point is the first stage: 4 per step, and the start
  CHECK(by_rk4->stats().jacobians == 0);
  const SolutionPtr by_euler =
      integrate::integrate(problem(decay), implicit_euler(), start(vector({1})), plan(1, 0.1));
  CHECK(by_euler->stats().newton_iterations == 10);  // linear: one iteration per step
}

}  // namespace pendula::runge_kutta_test
