// The active part of a large model: which equations rest, how the part grows, and that nothing is neglected.
#include "integrate/problem/active_subsystem.hpp"

#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "dae/model/first_order.hpp"
#include "integrate/run/adaptive_run.hpp"
#include "integrate/step/irk_stepper.hpp"
#include "integrate/step/subsystem_stepper.hpp"
#include "method/collocation.hpp"
#include "tests/integrate/problems.hpp"

namespace pendula::active_subsystem_test {

using namespace pendula::test;

namespace {

/// Cells v₁ … vₙ with vₖ′ = wₖ - 2 vₖ + wₖ₊₁ (the last: wₙ - vₙ) and
/// 0 = vₖ₋₁ + vₖ - 2 wₖ - wₖ³; v₀ = `source`.
ProblemPtr ladder(int cells, Expr source) {
  dae::FirstOrder model;
  for (int k = 1; k <= cells; ++k) {
    model.x.push_back(variable("v" + std::to_string(k)));
    model.xdot.push_back(derivative_leaf(model.x.back()));
    model.z.push_back(variable("w" + std::to_string(k)));
  }
  for (std::size_t k = 0; k < model.x.size(); ++k) {
    const Expr v = model.x[k], w = model.z[k];
    model.F.push_back((k > 0 ? model.x[k - 1] : source) + v - 2 * w - pow(w, Expr(3)));
    const Expr out = k + 1 < model.x.size() ? model.z[k + 1] - v : Expr(0);
    model.F.push_back(model.xdot[k] - (w - v) - out);
  }
  model.semi_explicit = true;
  return problem(std::move(model));
}

Point at_rest(const Problem& p) { return {0, Vec::Zero(p.n()), Vec::Zero(p.n()), Vec::Zero(p.m())}; }

std::shared_ptr<Stepper> radau(const ProblemPtr& p, const Tolerances& tolerances, Stats& stats) {
  return std::make_shared<IrkStepper>("radau", p, std::vector{radau_formula(3)}, std::vector<int>{},
                                      tolerances, StepLimits{}, stats);
}

}  // namespace

TEST_CASE("active part: equations are sorted by their distance from those that are not at rest") {
  const ProblemPtr p = ladder(50, sin(time_symbol()));
  const auto couplings = DependencyGraph::of(*p, 0, 10);
  REQUIRE(couplings);
  int active = 0;
  const std::vector<int> order = couplings->order(*p, at_rest(*p), active);
  CHECK(active == 1);  // the first one contains t, in the others every term is 0
  REQUIRE(order.size() == 100);
  CHECK(order[0] == 0);
  CHECK(std::max(order[1], order[2]) <= 2);

  Point moved = at_rest(*p);
  moved.x[30] = 1e-300;  // v₃₁ occurs in its own two equations and the first of cell 32
  couplings->order(*p, moved, active);
  CHECK(active == 4);

  CHECK(!DependencyGraph::of(*p, 0));      // small models are integrated as they stand
  CHECK(!DependencyGraph::of(*p, 1, 10));  // and those whose equations switch
}

TEST_CASE("active part: the first equations of the order are a model of their own with a rim") {
  const ProblemPtr p = ladder(50, sin(time_symbol()));
  const auto couplings = DependencyGraph::of(*p, 0, 10);
  int active = 0;
  const Point rest = at_rest(*p);
  const std::vector<int> order = couplings->order(*p, rest, active);
  const Subsystem part(*couplings, p, rest, order, 20);
  CHECK(!part.whole);
  CHECK(part.problem->n() + part.problem->m() == 20);
  CHECK(part.interface_x.size() + part.interface_z.size() >= 1);
  Point now = part.take(rest);
  CHECK(!part.touched(now, rest));
  if (part.interface_x.empty())
    now.z[part.interface_z[0]] = 5e-324;
  else
    now.x[part.interface_x[0]] = 5e-324;
  CHECK(part.touched(now, rest));

  // The residuals of the part are those of the whole, bit for bit.
  Point point = rest;
  for (std::size_t k = 0; k < part.x.size(); ++k) point.x[part.x[k]] = std::sin(1.0 + static_cast<double>(k));
  const Point some = part.take(point);
  std::vector<double> all(100), own(20);
  p->set_point(0.3, point.x.data(), point.xdot.data(), point.z.data());
  p->residual(all.data());
  part.problem->set_point(0.3, some.x.data(), some.xdot.data(), some.z.data());
  part.problem->residual(own.data());
  std::vector<int> rows(order.begin(), order.begin() + 20);
  std::sort(rows.begin(), rows.end());
  for (std::size_t k = 0; k < own.size(); ++k) CHECK(own[k] == all[rows[k]]);

  const Subsystem whole(*couplings, p, rest, order, 60);
  CHECK(whole.whole);
  CHECK(whole.problem == p);
  CHECK(whole.interface_x.size() + whole.interface_z.size() == 0);
}

TEST_CASE("active part: the solution is that of the whole model, and the part grows with it") {
  const ProblemPtr p = ladder(3000, sin(time_symbol()));
  const auto couplings = DependencyGraph::of(*p, 0, 10);
  REQUIRE(couplings);
  const Tolerances tolerances = Tolerances::uniform(6000, 1e-5, 1e-8);
  const FlushDenormals guard;
  const auto run = [&](Stepper& stepper) {
    stepper.start(at_rest(*p), 100);
    while (stepper.here().t < 100) stepper.step(100);
  };
  Stats whole_stats, part_stats;
  const auto whole = radau(p, tolerances, whole_stats);
  run(*whole);
  int parts = 0, largest = 0;
  const auto make = [&](const ProblemPtr& part, const Tolerances& own) -> std::shared_ptr<Stepper> {
    ++parts, largest = std::max(largest, part->n() + part->m());
    return radau(part, own, part_stats);
  };
  SubsystemStepper part(p, couplings, make, tolerances, {}, part_stats);
  run(part);
  CHECK(parts >= 2);
  CHECK(largest <= 2000);
  const Point &a = whole->here(), &b = part.here();
  CHECK(std::fabs(a.x[0]) > 0.1);
  // Both err by about the tolerance; the norm over fewer unknowns chooses other steps.
  CHECK((a.x - b.x).cwiseAbs().maxCoeff() <= 1e-4);
  CHECK((a.z - b.z).cwiseAbs().maxCoeff() <= 1e-4);
  CHECK(b.x.tail(1000) == Vec::Zero(1000));
  for (int k : {10, 50, 100})  // far from the source, where all is small, too
    CHECK(std::fabs(a.x[k] - b.x[k]) <= 1e-3 * std::fabs(a.x[k]) + 1e-9);
}

}  // namespace pendula::active_subsystem_test
