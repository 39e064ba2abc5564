// Every form of every model at a consistent start gives the accelerations and multipliers of every other one.
#include <doctest/doctest.h>

#include <cmath>

#include "base/error.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/start/start.hpp"
#include "mech/lagrangian.hpp"
#include "tests/error_text.hpp"

namespace pendula::reduce_forms_test {

namespace {

Expr var(const char* name) { return symbol(Kind::variable, name); }
Expr der(Expr e, int k = 1) { return derivative_leaf(e, k); }
VecX col(std::initializer_list<Expr> e) { return column(std::vector<Expr>(e)); }
VecX dots(const VecX& q, int k = 1) {
  return q.unaryExpr([=](Expr e) { return derivative_leaf(e, k); });
}

struct Problem {
  dae::ModelPtr model;
  dae::LeafValues fix;
  std::vector<Expr> probes;  ///< accelerations, multipliers
};

void probe(Problem& p, const VecX& q) {
  for (Expr a : dots(q, 2)) p.probes.push_back(a);
  for (Expr z : p.model->mechanics->multipliers) p.probes.push_back(z);
}

Problem pendulum() {
  const VecX q = column(symbol_vector(Kind::variable, "q", 3));
  mech::Lagrangian s;
  s.q = q;
  s.T = dots(q).dot(dots(q));  // m = 2
  s.V = Expr(2) * Expr(9.81) * q[2];
  s.C = col({(q.dot(q) - 1) / 2});
  Problem p{mech::lagrange(s), {{q[0], .6}, {q[1], 0}, {q[2], -.8}}, {}};
  p.fix.insert(p.fix.end(), {{der(q[0]), .8}, {der(q[1]), .5}, {der(q[2]), .6}});
  probe(p, q);
  return p;
}

Problem two_masses() {
  const VecX q = column(symbol_vector(Kind::variable, "q", 6));
  const Expr m = symbol(Kind::parameter, "m"), g = symbol(Kind::parameter, "g"),
             R = symbol(Kind::parameter, "R"), L = symbol(Kind::parameter, "L");
  const VecX p1 = q.head(3), d = q.tail(3) - q.head(3);
  mech::Lagrangian s;
  s.q = q;
  s.T = m / 2 * dots(q).dot(dots(q));
  s.V = m * g * (q[2] + q[5]);
  s.C = col({(p1.dot(p1) - R * R) / 2, (d.dot(d) - L * L) / 2});
  Problem p{dae::with_values(mech::lagrange(s), {{m, 1}, {g, Expr(9.81)}, {R, 1}, {L, Expr(0.5)}}), {}, {}};
  const double position[] = {.6, 0, -.8, .6, 0, -1.3}, velocity[] = {.8, .5, .6, 1.1, .3, .6};
  for (int i = 0; i < 6; ++i) {
    p.fix.push_back({q[i], position[i]});
    p.fix.push_back({der(q[i]), velocity[i]});
  }
  probe(p, q);
  return p;
}

/// Crank angle phi, rod angle psi, slider x: 0 = cos phi + 2 cos psi - x, 0 = sin phi + 2 sin psi. The mass
/// matrix is not diagonal.
Problem slider_crank() {
  const Expr phi = var("phi"), psi = var("psi"), x = var("x");
  mech::Lagrangian s;
  s.q = col({phi, psi, x});
  s.T = der(phi) * der(phi) + der(psi) * der(psi) / 2 + der(x) * der(x) / 2 +
        cos(phi - psi) * der(phi) * der(psi) / 2;
  s.V = 3 * sin(phi) + sin(psi);
  s.C = col({cos(phi) + 2 * cos(psi) - x, sin(phi) + 2 * sin(psi)});
  Problem p{mech::lagrange(s), {{phi, .7}, {der(phi), 1.3}}, {}};
  probe(p, s.q);
  return p;
}

dae::ConsistentStatePtr start_of(const Problem& p) {
  dae::StartRequest request;
  request.fix = p.fix;
  return dae::init(p.model, request);
}

/// The start of a relative in the unknowns of `low`.
dae::ConsistentStatePtr translated(const dae::ConsistentState& at, const dae::ModelPtr& low) {
  dae::StartRequest request;
  for (Expr leaf : low->states()) {
    REQUIRE(at.value_for(*low, leaf).has_value());
    request.fix.push_back({leaf, *at.value_for(*low, leaf)});
  }
  for (Expr leaf : low->algebraic())
    if (const auto value = at.value_for(*low, leaf)) request.guess.push_back({leaf, *value});
  return dae::init(low, request);
}

/// 1e-10: solved_below in start.cpp bounds what the residuals of both starts leave.
void check_agrees(const Problem& p, const dae::ConsistentState& at, const dae::ModelPtr& low) {
  CAPTURE(low->form);
  const auto other = translated(at, low);
  for (Expr e : p.probes) CHECK(std::fabs((*other)(e)-at(e)) < 1e-10 * (1 + std::fabs(at(e))));
  CHECK(other->free <= at.free);
}

void check_forms(const Problem& p, std::initializer_list<std::pair<const char*, int>> index_of_forms) {
  const auto at = start_of(p);
  dae::ReduceOptions options;
  for (const auto& [name, index] : index_of_forms) {
    const char* form = name;
    CAPTURE(form);
    options.at = std::string(form) == "dummy" ? at->values : std::unordered_map<Expr, double>{};
    const auto low = dae::reduce(p.model, form, options);
    const auto a = dae::analyse(*low);
    CHECK(a.regular);
    CHECK(a.index == index);
    CHECK(a.dof == dae::analyse(*p.model).dof);
    check_agrees(p, *at, low);
    if (low != p.model) CHECK(dae::trace(*low).find('\n') != std::string::npos);
  }
}

std::string reason(const Problem& p, const char* form) {
  return test::error_text([&] { dae::reduce(p.model, form); });
}

}  // namespace

TEST_CASE("3-D pendulum: every form, its index, the same accelerations and multiplier") {
  check_forms(pendulum(),
              {{"acc", 1}, {"ggl", 2}, {"baumgarte", 1}, {"ode", 0}, {"project", 0}, {"dummy", 1}, {"", 0}});
  CHECK(reason(pendulum(), "minimal").find("which root holds depends on where the solution is") !=
        std::string::npos);
}

TEST_CASE("the exam's two masses: every form, its index, the same accelerations and multipliers") {
  check_forms(two_masses(),
              {{"acc", 1}, {"ggl", 2}, {"baumgarte", 1}, {"ode", 0}, {"project", 0}, {"dummy", 1}, {"", 0}});
}

TEST_CASE("slider-crank with a full mass matrix: every form, its index, the same accelerations") {
  check_forms(slider_crank(),
              {{"acc", 1}, {"ggl", 2}, {"baumgarte", 1}, {"ode", 0}, {"project", 0}, {"dummy", 1}, {"", 0}});
  CHECK(reason(slider_crank(), "minimal").find("sin(phi)") == std::string::npos);  // Greek letters in text
  CHECK(reason(slider_crank(), "minimal").find("C₂") != std::string::npos);
}

TEST_CASE("minimal: a bead on a parabola y = x², and a chain of dependent coordinates") {
  const Expr x = var("x"), y = var("y"), w = var("w");
  mech::Lagrangian s;
  s.q = col({x, y, w});
  s.T = (der(x) * der(x) + der(y) * der(y) + der(w) * der(w)) / 2;
  s.V = 9 * y;
  s.C = col({y - x * x, x * w - y - 1});
  Problem p{mech::lagrange(s), {{x, 1.5}, {der(x), .5}}, {}};
  probe(p, s.q);
  const auto low = dae::reduce(p.model, "minimal");
  CHECK(low->states() == std::vector<Expr>{x, der(x)});
  CHECK(low->drift == dae::DriftLaw::none);
  check_forms(p, {{"minimal", 0}, {"ode", 0}, {"dummy", 1}});
  CHECK(dae::trace(*low).find("valid where x ≠ 0") != std::string::npos);
}

TEST_CASE("minimal in first order: the velocity of a dependent coordinate goes with it") {
  const Expr x = var("x"), y = var("y"), vx = var("vx"), vy = var("vy"), z = var("z");
  Problem p{dae::make_model({{col({der(x), der(y)}), col({vx, vy}), ""},
                             {col({der(vx), der(vy)}), col({2 * x * z, -z - 9}), ""},
                             {col({0}), col({y - x * x}), ""}}),
            {{x, 1.5}, {vx, .5}},
            {der(vx), der(vy), z}};
  CHECK(dae::reduce(p.model, "minimal")->states() == std::vector<Expr>{x, vx});
  check_forms(p, {{"minimal", 0}, {"ggl", 2}, {"baumgarte", 1}, {"project", 0}, {"dummy", 1}});
}

TEST_CASE("a model of index 2 (CSTR with prescribed product): forms that apply, and why ggl does not") {
  const Expr c = var("c"), T = var("T"), R = var("R"), t = time_symbol();
  Problem p{dae::make_model({{col({der(c)}), col({2 * (1 - c) - R}), ""},
                             {col({der(T)}), col({3 * (1 - T) + 2 * R}), ""},
                             {col({0}), col({c * T - 1 - sin(t) / 9}), ""}}),
            {{c, .8}},
            {R, der(c), der(T)}};
  CHECK(dae::analyse(*p.model).index == 2);
  check_forms(p, {{"acc", 1}, {"baumgarte", 1}, {"ode", 0}, {"project", 0}, {"dummy", 1}, {"minimal", 0}});
  CHECK(reason(p, "ggl").find("no constraint is differentiated twice") != std::string::npos);
}

TEST_CASE("index 1 and 0: nothing to stabilise; ode eliminates algebraic variables where they are linear") {
  const Expr x = var("x"), z = var("z");
  const Problem linear{dae::make_model({{col({der(x)}), col({z - x}), ""}, {col({0}), col({x + 2 * z}), ""}}),
                       {{x, 2}},
                       {z, der(x)}};
  check_forms(linear, {{"ode", 0}, {"acc", 1}, {"", 1}});
  for (const char* form : {"ggl", "baumgarte", "dummy"})
    CHECK(reason(linear, form).find("it can be integrated as it stands") != std::string::npos);
  CHECK(reason(linear, "project").find("nothing to project onto") != std::string::npos);
  CHECK(reason(linear, "minimal").find("all its states are independent") != std::string::npos);
  const Problem cubic{
      dae::make_model({{col({der(x)}), col({z}), ""}, {col({0}), col({z * z * z + z - x}), ""}}), {}, {}};
  CHECK(reason(cubic, "ode").find("equation (2)  0 = ") != std::string::npos);
  CHECK(reason(cubic, "ode").find("is not linear in z") != std::string::npos);
  CHECK(reason(linear, "ac").find("Did you mean 'acc'?") != std::string::npos);
}

TEST_CASE("an algebraic variable whose equation is differentiated becomes a state") {
  const Expr x = var("x"), w = var("w"), z = var("z"), y = var("y"), t = time_symbol();
  const Problem p{dae::make_model({{col({0, 0}), col({x + w - sin(t), x - w - cos(t)}), ""},
                                   {col({z, der(y)}), col({der(x), z - y}), ""}}),
                  {{y, 1}},
                  {z, der(y)}};
  check_forms(p, {{"acc", 1}, {"ode", 0}, {"baumgarte", 1}, {"project", 0}, {"dummy", 1}, {"minimal", 0}});
}

TEST_CASE("baumgarte: the residual is C″ + 2α C′ + β² C; gains are checked and can be parameters") {
  const auto p = pendulum();
  dae::ReduceOptions options;
  const Expr alpha = symbol(Kind::parameter, "alpha_b");
  options.alpha = alpha, options.beta = Expr(3);
  const auto low = dae::reduce(p.model, "baumgarte", options), acc = dae::reduce_acc(p.model);
  const Expr wanted =
      acc->blocks[1].rhs[0] + 2 * alpha * acc->invariants[1].residual + Expr(9) * acc->invariants[0].residual;
  const Expr pair[] = {low->blocks[1].rhs[0], wanted};
  const auto v = evaluate(pair, dae::random_point(pair, 0));
  CHECK(std::fabs(v[0] - v[1]) < 1e-12);
  CHECK(low->drift == dae::DriftLaw::decay);
  CHECK(dae::trace(*low).find("Warning: the gains") != std::string::npos);
  options.alpha = Expr(-1);
  CHECK(test::error_text([&] {
          dae::reduce(p.model, "baumgarte", options);
        }).find("alpha = -1 must be positive") != std::string::npos);
  options.alpha = Expr(1);
  CHECK(test::error_text([&] { dae::reduce(p.model, "ode", options); }).find("form \"ode\" has none") !=
        std::string::npos);
}

TEST_CASE("project: a state off the constraints moves back, positions first, by least steps") {
  for (const Problem& p : {pendulum(), two_masses(), slider_crank()}) {
    const auto low = dae::reduce(p.model, "project");
    REQUIRE(low->projections.size() == 2);
    CHECK(low->projections[0].weight.size() > 0);
    auto values = start_of(p)->values;
    const auto exact = values;
    double change = dae::project(*low, values);
    CHECK(change < 1e-9);
    int k = 0;
    for (Expr x : low->states()) values[x] += 1e-3 * std::sin(++k);
    change = dae::project(*low, values);
    CHECK(change > 1e-5);
    CHECK(change < 1e-2);
    for (const dae::Constraint& c : low->invariants)
      CHECK(std::fabs(evaluate({&c.residual, 1}, values)[0]) < 1e-13);
    for (Expr x : low->states()) CHECK(std::fabs(values[x] - exact.at(x)) < 1e-2);
  }
}

TEST_CASE("project: a step in the norm of the mass matrix is W-orthogonal to the constraint surface") {
  const auto p = slider_crank();
  const auto low = dae::reduce(p.model, "project");
  auto values = start_of(p)->values;
  const auto& q = p.model->mechanics->q;
  for (Expr x : q) values[x] += 1e-6;
  const auto before = values;
  dae::project(*low, values);
  const auto n = q.size(), m = p.model->mechanics->C.size();
  const Mat W = dae::evaluate(dae::dense(p.model->mechanics->M, n, n), before),
            G = dae::evaluate(dae::dense(p.model->mechanics->dCdq, m, n), before);
  Vec dq(q.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) dq[i] = values[q[i]] - before.at(q[i]);
  const Vec along = dae::null_space(G).transpose() * W * dq;
  CHECK(along.norm() < 1e-10 * (1 + dq.norm()));
}

/// Of a selection at a point, with the parameter values of the model.
static double quality_of(const dae::DummySelection& selection, const dae::ModelPtr& model,
                         std::unordered_map<Expr, double> point) {
  for (const auto& [parameter, value] : model->values) point.emplace(parameter, evaluate({&value, 1}, {})[0]);
  const dae::DummyPivoting pivoting(model);
  return pivoting.quality(selection, evaluate(pivoting.slopes, point));
}

TEST_CASE("dummy: the selection follows the point, and its quality falls towards the singular point") {
  const auto p = pendulum();
  const VecX& q = p.model->mechanics->q;
  const auto at = [&](double x, double y, double z) {
    return std::unordered_map<Expr, double>{{q[0], x}, {q[1], y}, {q[2], z}};
  };
  const auto low = dae::select_dummies(p.model, at(0, 0, -1)),
             side = dae::select_dummies(p.model, at(1, 0, 0));
  CHECK(low.dummies == std::vector<Expr>{der(q[2]), der(q[2], 2)});
  CHECK(side.dummies == std::vector<Expr>{der(q[0]), der(q[0], 2)});
  CHECK(low.quality == doctest::Approx(1));
  const auto both = dae::select_dummies(two_masses().model, start_of(two_masses())->values);
  CHECK(both.dummies.size() == 4);
  CHECK(quality_of(both, two_masses().model, start_of(two_masses())->values) ==
        doctest::Approx(both.quality));
  CHECK(test::error_text([&] { dae::select_dummies(p.model, at(0, 0, 0)); }).find("singular") !=
        std::string::npos);
  CHECK(test::error_text([&] {
          dae::select_dummies(p.model, {{q[0], 1}});
        }).find("gives no value for") != std::string::npos);
  auto foreign = low;
  foreign.dummies = {der(symbol(Kind::variable, "w")), der(symbol(Kind::variable, "w"), 2)};
  CHECK(test::error_text([&] {
          quality_of(foreign, p.model, at(0, 0, -1));
        }).find("the selection of dummy derivatives is of another model") != std::string::npos);
  const auto model = dae::reduce_dummy(p.model, side);
  CHECK(dae::trace(*model).find("States: q₂, q₂′, q₃, q₃′") != std::string::npos);
}

TEST_CASE("lineage: forms can be made of forms, and keep parameter values") {
  const auto p = two_masses();
  const auto ode = dae::reduce(dae::reduce(p.model, "acc"), "ode");
  CHECK(ode->kind == dae::ModelKind::ode);
  CHECK(ode->form == "ode");
  const Expr L = symbol(Kind::parameter, "L");
  const auto longer = dae::with_values(ode, {{L, Expr(2)}});
  const auto ggl = dae::reduce(longer, "ggl");
  CHECK(ggl->values.at(L) == Expr(2));
  CHECK(dae::reduce(p.model, "acc")->drift == dae::DriftLaw::polynomial);
  CHECK(ode->drift == dae::DriftLaw::polynomial);
  CHECK(dae::reduce(p.model, "")->form == "project");
  CHECK(dae::trace(*dae::reduce(p.model, "")).find("reduce() chose form \"project\"") != std::string::npos);
  CHECK(dae::first_order(*ode).is_ode());
}

TEST_CASE("a massless coordinate: its zero coefficient is not divided by") {
  const Expr x = var("x"), y = var("y"), m = symbol(Kind::parameter, "m_light");
  mech::Lagrangian s;
  s.q = col({x, y});
  s.T = der(x) * der(x) / 2 + m * der(y) * der(y) / 2;
  s.C = col({y - x * x});
  s.V = 9 * y;
  Problem p{dae::with_values(mech::lagrange(s), {{m, Expr(0)}}), {{x, 1}, {der(x), 1}}, {}};
  probe(p, s.q);
  check_forms(p, {{"ode", 0}, {"acc", 1}});
}

}  // namespace pendula::reduce_forms_test
