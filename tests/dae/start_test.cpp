// Consistent starts of mechanical index-3 models, against the numbers of scripts/exam/problem1.lua
// and against conditions by hand.
#include <doctest/doctest.h>

#include <cmath>

#include "base/error.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/make_model.hpp"
#include "dae/rank/magnitudes.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/start.hpp"
#include "mech/lagrangian.hpp"
#include "tests/error_text.hpp"

namespace pendula::start_test {

namespace {

VecX dots(const VecX& q, int k = 1) {
  return q.unaryExpr([=](Expr e) { return derivative_leaf(e, k); });
}

struct TwoMasses {
  VecX q = column(symbol_vector(Kind::variable, "q", 6));
  dae::ModelPtr model;
  TwoMasses() {
    const Expr m = symbol(Kind::parameter, "m"), g = symbol(Kind::parameter, "g"),
               R = symbol(Kind::parameter, "R"), L = symbol(Kind::parameter, "L");
    mech::Lagrangian s;
    const VecX p1 = q.head(3), d = q.tail(3) - q.head(3), v = dots(q);
    s.q = q;
    s.T = m / 2 * v.dot(v);
    s.V = m * g * (q[2] + q[5]);
    s.C.resize(2);
    s.C << (p1.dot(p1) - R * R) / 2, (d.dot(d) - L * L) / 2;
    model = dae::with_values(mech::lagrange(s), {{m, 1}, {g, Expr(9.81)}, {R, 1}, {L, Expr(0.5)}});
  }
  dae::LeafValues fix(std::array<double, 6> position, std::array<double, 6> velocity) const {
    dae::LeafValues list;
    for (int i = 0; i < 6; ++i)
      list.push_back({q[i], position[i]}), list.push_back({derivative_leaf(q[i]), velocity[i]});
    return list;
  }
};

const std::array<double, 6> exam_position{.6, 0, -.8, .6, 0, -1.3}, exam_velocity{.8, .5, .6, 1.1, .3, .6};

}  // namespace

TEST_CASE("exam 1b: index 3, eight free initial values, conditions C = 0 and C′ = 0") {
  const TwoMasses s;
  const auto a = dae::analyse(*s.model);
  CHECK(a.regular);
  CHECK(a.index == 3);
  CHECK(a.dof == 8);
  CHECK(dae::hidden_constraints_by_offsets(*s.model, a).size() == 4);
  const auto low = dae::reduce_acc(s.model);
  CHECK(dae::analyse(*low).index == 1);
  CHECK(dae::analyse(*low).dof == 8);
  CHECK(low->kind == dae::ModelKind::fully_implicit);
}

TEST_CASE("exam 1b: accelerations and multipliers at a consistent start to 1e-11") {
  const TwoMasses s;
  dae::StartRequest request;
  request.fix = s.fix(exam_position, exam_velocity);
  const auto at = dae::init(s.model, request);
  const double acceleration[] = {-8.119411764706, 0, -4.527058823529, 0, 0, -4.267058823529};
  for (int i = 0; i < 6; ++i) CHECK(std::fabs((*at)(derivative_leaf(s.q[i], 2)) - acceleration[i]) < 1e-11);
  const auto& z = s.model->mechanics->multipliers;
  CHECK(std::fabs((*at)(z[0]) - 13.532352941176) < 1e-11);
  CHECK(std::fabs((*at)(z[1]) - 11.085882352941) < 1e-11);
  CHECK(at->free == 8);
}

TEST_CASE("twelve fixes where eight are free: four are redundant, and the ledger says so") {
  const TwoMasses s;
  dae::StartRequest request;
  request.fix = s.fix(exam_position, exam_velocity);
  int redundant = 0;
  const auto at = dae::init(s.model, request);
  for (const auto& row : at->rows) redundant += row.origin == dae::Origin::redundant;
  CHECK(redundant == 4);
}

TEST_CASE("contradicting fixes: the conflict is named, with the residual") {
  const TwoMasses s;
  dae::StartRequest request;
  request.fix = s.fix({.6, 0, -.9, .6, 0, -1.4}, exam_velocity);
  const std::string text = test::error_text([&] { dae::init(s.model, request); });
  CHECK(text.find("contradict") != std::string::npos);
  CHECK(text.find("C₁") != std::string::npos);
}

TEST_CASE("too few fixes: the candidates are listed, unless a guess covers them") {
  const TwoMasses s;
  dae::StartRequest request;
  for (int i = 0; i < 6; ++i) request.fix.push_back({s.q[i], exam_position[i]});
  CHECK(test::error_text([&] {
          dae::init(s.model, request);
        }).find("4 initial values are neither fixed nor determined") != std::string::npos);
  for (int i = 0; i < 6; ++i) request.guess.push_back({derivative_leaf(s.q[i]), 0});
  const auto at = dae::init(s.model, request);
  for (int i = 0; i < 6; ++i)
    CHECK(std::fabs((*at)(derivative_leaf(s.q[i]))) < 1e-12);  // nearest to the guess: at rest
}

TEST_CASE("a guess is only a starting point: it moves onto the constraint") {
  const TwoMasses s;
  dae::StartRequest request;
  for (int i = 0; i < 6; ++i) {
    request.guess.push_back({s.q[i], exam_position[i] * 1.1});
    request.guess.push_back({derivative_leaf(s.q[i]), exam_velocity[i]});
  }
  const auto at = dae::init(s.model, request);
  double length = 0;
  for (int i = 0; i < 3; ++i) length += std::pow((*at)(s.q[i]), 2);
  CHECK(length == doctest::Approx(1).epsilon(1e-10));  // solved_below in start.cpp
}

TEST_CASE("a start serves the first-order form: v means q′") {
  const TwoMasses s;
  dae::StartRequest request;
  request.fix = s.fix(exam_position, exam_velocity);
  const auto at = dae::init(s.model, request);
  const auto first = dae::to_first_order(s.model);
  CHECK(dae::analyse(*first).index == 3);
  for (Expr leaf : first->states()) CHECK(at->value_for(*first, leaf).has_value());
}

TEST_CASE("a parameter without a value and an input without a value are named") {
  const Expr x = symbol(Kind::variable, "x"), k = symbol(Kind::parameter, "k_without_value"),
             u = symbol(Kind::input, "u");
  VecX l(1), r(1);
  l << derivative_leaf(x);
  r << -k * x;
  CHECK(test::error_text([&] {
          dae::init(dae::make_model({{l, r, ""}}), {});
        }).find("'k_without_value' has no value") != std::string::npos);
  r << u - x;
  CHECK(test::error_text([&] {
          dae::init(dae::make_model({{l, r, ""}}), {});
        }).find("input 'u' has no value") != std::string::npos);
}

TEST_CASE(
    "sizes of unknowns: equations that are kept give with other values what new ones give, bit for bit") {
  const Expr a = symbol(Kind::variable, "a"), b = symbol(Kind::variable, "b"),
             c = symbol(Kind::variable, "c"), p = symbol(Kind::parameter, "p"),
             q = symbol(Kind::parameter, "q");
  const std::vector<Expr> unknowns{a, b, c}, leaves{p, q};
  const std::vector<Expr> rows{p * a - 3 * b * b + Expr(9.81) * c, a * p + a * q - b * c, sin(a / q) - b * p};
  const auto fresh = [&](double p_value, double q_value) {
    return dae::magnitudes(rows, rows.size(), unknowns, {{p, p_value}, {q, q_value}}, {{c, 4.0}});
  };
  dae::SizeEquations kept(rows, rows.size(), unknowns, leaves, std::vector{2.0, 5.0});
  const auto again = [&](double p_value, double q_value) {
    return kept(std::vector{p_value, q_value}, {{2, 4.0}});
  };
  for (const auto& [p_value, q_value] : {std::pair{2.0, 5.0}, {1e-3, 7.5}, {-40.0, 1e4}, {2.0, 5.0}}) {
    const auto found = again(p_value, q_value);
    REQUIRE(found);
    const dae::Magnitudes expected = fresh(p_value, q_value);
    CHECK(found->unknowns == expected.unknowns);
    CHECK(found->rows == expected.rows);
  }
  CHECK(again(1e-3, 7.5)->unknowns != again(2.0, 5.0)->unknowns);
  CHECK_FALSE(again(0, 5));      // the terms with p are gone
  CHECK_FALSE(again(2, 1e-12));  // a q says nothing beside a p
  dae::SizeEquations small(rows, rows.size(), unknowns, leaves, std::vector{2.0, 1e-12});
  CHECK(small(std::vector{2.0, 2e-12}, {{2, 4.0}})->unknowns == fresh(2, 2e-12).unknowns);
  CHECK_FALSE(small(std::vector{2.0, 5.0}, {{2, 4.0}}));
}

TEST_CASE("sizes of unknowns: a factor of an unknown is one of its unit") {
  const Expr a = symbol(Kind::variable, "a"), b = symbol(Kind::variable, "b"),
             k = symbol(Kind::parameter, "k");
  const std::vector<Expr> rows{k * a - b, b * b - 7};  // b = √7, a = √7/k
  const dae::Magnitudes plain = dae::magnitudes(rows, 2, {a, b}, {{k, 1.0}}, {});
  const dae::Magnitudes nano = dae::magnitudes(rows, 2, {a, b}, {{k, 1e9}}, {});
  CHECK(plain.unknowns[1] == doctest::Approx(std::sqrt(7.0)).epsilon(1e-9));
  CHECK(nano.unknowns[0] == doctest::Approx(1e-9 * plain.unknowns[0]).epsilon(1e-9));
  CHECK(nano.unknowns[1] == doctest::Approx(plain.unknowns[1]).epsilon(1e-9));
}

}  // namespace pendula::start_test
