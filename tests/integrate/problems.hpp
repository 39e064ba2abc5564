// Models written by hand as the integrators see them, with their solutions.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "dae/model/first_order.hpp"
#include "integrate/run/fixed_step_run.hpp"
#include "method/tableau_text.hpp"

namespace pendula::test {

using namespace pendula::integrate;

inline Expr variable(const std::string& name) { return symbol(Kind::variable, name); }

/// x′ = f(t, x), written with F = x′ - f and the explicit form.
inline dae::FirstOrder ode(const std::vector<Expr>& x, const std::vector<Expr>& f) {
  dae::FirstOrder model;
  model.x = x;
  model.f = f;
  model.semi_explicit = true;
  for (std::size_t i = 0; i < x.size(); ++i) {
    model.xdot.push_back(derivative_leaf(x[i]));
    model.F.push_back(model.xdot[i] - f[i]);
  }
  return model;
}

/// The same equations without the explicit form: everything goes through F(t, x, x′, z) = 0.
inline dae::FirstOrder hidden(dae::FirstOrder model) {
  model.semi_explicit = false;
  model.f.clear();
  model.g.clear();
  return model;
}

inline ProblemPtr problem(dae::FirstOrder model) {
  return std::make_shared<Problem>(std::move(model), Vec());
}

inline Vec vector(std::initializer_list<double> values) {
  Vec v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

inline Point start(Vec x, Vec xdot = {}, Vec z = {}) {
  return {0, std::move(x), std::move(xdot), std::move(z)};
}

inline TableauPtr share(Tableau tableau) { return std::make_shared<const Tableau>(std::move(tableau)); }

inline TableauPtr drawn(const std::string& drawing, const std::string& name = "drawn") {
  TableauData data = parse_tableau(drawing);
  data.name = name;
  return share(Tableau(data));
}

inline Plan plan(double to, double dt) {
  Plan p;
  p.to = to, p.dt = dt;
  return p;
}

inline TableauPtr euler() { return drawn("0 | \n | 1", "euler"); }
inline TableauPtr rk4() {
  return drawn("0 | \n 1/2 | 1/2 \n 1/2 | 0 1/2 \n 1 | 0 0 1 \n | 1/6 1/3 1/3 1/6", "rk4");
}
inline TableauPtr implicit_euler() { return drawn("1 | 1 \n | 1", "implicit_euler"); }
inline TableauPtr trapezoid() { return drawn("0 | 0 \n 1 | 1/2 1/2 \n | 1/2 1/2", "trapezoid"); }

/// The point mass on a sphere of radius 1 in index-1 form, m = 1, g = 9.81: p′ = v, v′ = -g e₃ - z p,
/// 0 = p·v′ + v·v (pᵀp/2 differentiated twice). Fully implicit: the last equation contains v′.
inline dae::FirstOrder pendulum3d() {
  dae::FirstOrder model;
  for (const char* name : {"p1", "p2", "p3", "v1", "v2", "v3"}) model.x.push_back(variable(name));
  for (Expr x : model.x) model.xdot.push_back(derivative_leaf(x));
  const Expr z = variable("z");
  model.z = {z};
  const std::span p(model.x.data(), 3), v(model.x.data() + 3, 3), a(model.xdot.data() + 3, 3);
  const Expr gravity[] = {0, 0, Expr(9.81)};
  Expr acceleration;
  for (int i = 0; i < 3; ++i) model.F.push_back(model.xdot[i] - v[i]);
  for (int i = 0; i < 3; ++i) {
    model.F.push_back(a[i] + gravity[i] + z * p[i]);
    acceleration += p[i] * a[i] + v[i] * v[i];
  }
  model.F.push_back(acceleration);
  model.label = {"p1' = v1", "p2' = v2", "p3' = v3", "v1'", "v2'", "v3'", "C''"};
  return model;
}

/// The same as semi-explicit DAE: the multiplier from the constraint after v′ is
/// substituted, z pᵀp = vᵀv - g p₃.
inline dae::FirstOrder pendulum3d_semi_explicit() {
  dae::FirstOrder model = pendulum3d();
  const auto& x = model.x;
  const Expr z = model.z[0], g(9.81);
  model.semi_explicit = true;
  model.f = {x[3], x[4], x[5], -z * x[0], -z * x[1], -g - z * x[2]};
  model.g = {z * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) - x[3] * x[3] - x[4] * x[4] - x[5] * x[5] +
             g * x[2]};
  model.F.clear();
  for (std::size_t i = 0; i < 6; ++i) model.F.push_back(model.xdot[i] - model.f[i]);
  model.F.push_back(model.g[0]);
  return model;
}

inline Point pendulum_start() { return start(vector({1, 0, 0, 0, 1, 0})); }

/// A smooth initial value problem with its solution.
struct Ivp {
  std::string name;
  dae::FirstOrder model;
  Point start;
  double to;
  std::function<Vec(double)> solution;
};

/// Nonlinear and non-autonomous, with solutions in closed form: linear problems see only the tall trees
/// (docs/style.md#numeric-tests-that-can-fail).
inline std::vector<Ivp> smooth_problems() {
  const Expr x = variable("x"), y = variable("y"), t = time_symbol();
  std::vector<Ivp> list;
  list.push_back({"x' = -x^2", ode({x}, {-x * x}), start(vector({1})), 1,
                  [](double s) { return vector({1 / (1 + s)}); }});
  list.push_back({"x' = t x^2 (non-autonomous)", ode({x}, {t * x * x}), start(vector({0.5})), 1,
                  [](double s) { return vector({1 / (2 - s * s / 2)}); }});
  // x = exp(sin t), y = cos t: x′ = x y, y′ = -sin t = -log x.
  list.push_back(
      {"x' = x y, y' = -log x", ode({x, y}, {x * y, -log(x)}), start(vector({1, 1})), 1, [](double s) {
         return vector({std::exp(std::sin(s)), std::cos(s)});
       }});
  // Fully implicit, not solvable by folding: x′³ + x′ = x³ + x with x = eᵗ.
  dae::FirstOrder implicit = ode({x}, {x});
  const Expr d = implicit.xdot[0];
  implicit.F = {d * d * d + d - x * x * x - x};
  list.push_back({"x'^3 + x' = x^3 + x", hidden(implicit), start(vector({1}), vector({1})), 1,
                  [](double s) { return vector({std::exp(s)}); }});
  return list;
}

}  // namespace pendula::test
