// Two roads: Lagrange's equations against equations written by hand, at random states.
#include <doctest/doctest.h>

#include <random>

#include "base/error.hpp"
#include "dae/rank/rank.hpp"
#include "mech/lagrangian.hpp"
#include "tests/error_text.hpp"

namespace pendula::lagrangian_test {

namespace {

Expr var(const char* name) { return symbol(Kind::variable, name); }
Expr param(const char* name) { return symbol(Kind::parameter, name); }
Expr dot(Expr e, int k = 1) { return derivative_leaf(e, k); }
VecX col(std::initializer_list<Expr> e) { return column(std::vector<Expr>(e)); }

/// |a - b| at 20 seeded random points; both sides are O(10), so 1e-12 is about 5000 ulp of the terms.
void check_same(Expr a, Expr b) {
  for (int attempt = 0; attempt < 20; ++attempt) {
    const Expr pair[] = {a, b};
    const auto v = evaluate(pair, dae::random_point(pair, attempt));
    CAPTURE(attempt);
    CHECK(v[0] == doctest::Approx(v[1]).epsilon(1e-12));
  }
}

mech::Lagrangian cart_pendulum() {  // angle from the horizontal (ERRATA, lecture)
  const Expr x = var("x"), th = var("theta"), m = param("m"), M = param("M"), L = param("L"), g = param("g");
  mech::Lagrangian s;
  s.q = col({x, th});
  s.T =
      (m + M) * dot(x) * dot(x) / 2 + M * L * L * dot(th) * dot(th) / 2 - L * M * dot(th) * dot(x) * sin(th);
  s.V = M * g * L * sin(th);
  return s;
}

std::string message(const mech::Lagrangian& s) {
  return test::error_text([&] { mech::lagrange(s); });
}

}  // namespace

TEST_CASE("cart-pendulum: mass matrix and right side as derived by hand") {
  const Expr th = var("theta"), m = param("m"), M = param("M"), L = param("L"), g = param("g");
  const auto model = mech::lagrange(cart_pendulum());
  const auto& mech = *model->mechanics;
  const MatX W = dae::dense(mech.M, 2, 2);
  check_same(W(0, 0), m + M);
  check_same(W(0, 1), -M * L * sin(th));
  check_same(W(1, 0), -M * L * sin(th));
  check_same(W(1, 1), M * L * L);
  check_same(mech.rhs[0], M * L * dot(th) * dot(th) * cos(th));
  check_same(mech.rhs[1], -M * g * L * cos(th));
  CHECK(model->kind == dae::ModelKind::implicit_ode);
}

TEST_CASE("the exam's two masses: W, right side, ∂C/∂q and the quadratic velocity terms") {
  const VecX q = column(symbol_vector(Kind::variable, "q", 6));
  const Expr m = param("m"), g = param("g"), R = param("R"), L = param("L");
  const VecX p1 = q.head(3), p2 = q.tail(3), v = q.unaryExpr([](Expr e) { return derivative_leaf(e); });
  mech::Lagrangian s;
  s.q = q;
  s.T = m / 2 * v.dot(v);
  s.V = m * g * (p1[2] + p2[2]);
  const VecX d = p2 - p1;
  s.C = col({(p1.dot(p1) - R * R) / 2, (d.dot(d) - L * L) / 2});
  const auto model = mech::lagrange(s);
  const auto& mech = *model->mechanics;
  CHECK(model->kind == dae::ModelKind::semi_explicit);
  CHECK(model->states().size() == 12);
  CHECK(model->algebraic().size() == 2);
  for (int i = 0; i < 6; ++i) {
    CHECK(dae::dense(mech.M, 6, 6)(i, i) == m);
    check_same(mech.rhs[i], i % 3 == 2 ? -m * g : Expr(0));
    check_same(dae::dense(mech.dCdq, 2, 6)(0, i), i < 3 ? q[i] : Expr(0));
    check_same(dae::dense(mech.dCdq, 2, 6)(1, i), i < 3 ? q[i] - q[i + 3] : q[i] - q[i - 3]);
  }
  const auto form = mech::matrix_form(mech);
  const VecX v1 = v.head(3), w = v.tail(3) - v.head(3);
  check_same(form.c[6], -v1.dot(v1));  // C₁″ without q″: |v₁|²
  check_same(form.c[7], -w.dot(w));
}

TEST_CASE("generalised forces by virtual work") {
  const Expr th = var("theta"), l = param("l"), F = param("F");
  const VecX q = col({th}), p = col({l * sin(th), -l * cos(th)}), force = col({F, 0});
  check_same(mech::generalized_force(q, {{p, force}})[0], F * l * cos(th));
}

TEST_CASE("an energy with explicit time: the term ∂²L/∂q′∂t is there") {
  const Expr x = var("x"), t = time_symbol();
  mech::Lagrangian s;
  s.q = col({x});
  s.T = pow(1 + t, Expr(2)) * dot(x) * dot(x) / 2;
  const auto model = mech::lagrange(s);  // (1+t)² x″ + 2 (1+t) x′ = 0
  check_same(model->residuals[0], pow(1 + t, Expr(2)) * dot(x, 2) + 2 * (1 + t) * dot(x));
}

TEST_CASE("massless coordinates are legitimate when constraints determine them") {
  const Expr x = var("x"), y = var("y"), m = param("m");
  mech::Lagrangian s;
  s.q = col({x, y});
  s.T = m * dot(x) * dot(x) / 2;
  CHECK(message(s).find("the kinetic energy is 0 for a motion of y") != std::string::npos);
  s.C = col({y - x * x});
  CHECK(message(s).empty());
}

TEST_CASE("bad input names the culprit and the remedy") {
  mech::Lagrangian s = cart_pendulum();
  s.C = col({param("R") - 1});
  CHECK(message(s).find("C[1] = R - 1 depends on no coordinate") != std::string::npos);
  s.C = col({var("x") - 1, 2 * var("x") - 3});
  CHECK(message(s).find("C[2] = 2 x - 3 contradicts C₁: together they say 0 = -1") != std::string::npos);
  s = cart_pendulum();
  s.T = Expr(0);
  CHECK(message(s).find("contains no velocity") != std::string::npos);
  s = cart_pendulum();
  s.Q = col({1, 2, 3});
  CHECK(message(s).find("Q has 3 rows, but there are 2 coordinates") != std::string::npos);
  s = cart_pendulum();
  s.V = s.V + var("w");
  CHECK(message(s).find("'w' is not in q") != std::string::npos);
}

}  // namespace pendula::lagrangian_test
