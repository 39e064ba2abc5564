// Linear programs and parameter sets against GLPK (libglpk-dev, used here only) and against brute force.
#include <algorithm>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "sysid/noise/likelihood.hpp"
#include "sysid/noise/linear_program.hpp"

#ifdef PENDULA_GLPK
#include <glpk.h>
#endif

namespace pendula::oracle_test {

using namespace pendula::sysid;

namespace {

Mat random_matrix(std::mt19937_64& g, Index rows, Index cols) {
  std::uniform_real_distribution<double> flat(-1, 1);
  return Mat(rows, cols).unaryExpr([&](double) { return flat(g); });
}

Regression random_regression(std::mt19937_64& g, Index rows, Index d) {
  Regression r;
  r.Phi = random_matrix(g, rows, d);
  r.y = r.Phi * Vec::Ones(d) + Vec(random_matrix(g, rows, 1));
  for (Index i = 0; i < d; ++i) r.names.push_back("p" + std::to_string(i + 1));
  for (Index i = 1; i <= rows; ++i) r.sample.push_back(i);
  return r;
}

#ifdef PENDULA_GLPK

struct Oracle {
  int status = 0;
  double value = 0;
  Vec x, dual;
};

/// min cᵀx subject to lower ≤ G x ≤ upper, x free.
Oracle glpk(const Vec& c, const Mat& G, const Vec& lower, const Vec& upper) {
  glp_term_out(GLP_OFF);
  glp_prob* const lp = glp_create_prob();
  const int m = static_cast<int>(G.rows()), n = static_cast<int>(G.cols());
  glp_set_obj_dir(lp, GLP_MIN);
  glp_add_rows(lp, m);
  glp_add_cols(lp, n);
  for (int j = 1; j <= n; ++j) glp_set_col_bnds(lp, j, GLP_FR, 0, 0), glp_set_obj_coef(lp, j, c[j - 1]);
  std::vector<int> index(static_cast<std::size_t>(n + 1));
  std::vector<double> row(index.size());
  for (int i = 1; i <= m; ++i) {
    const bool low = std::isfinite(lower[i - 1]);
    glp_set_row_bnds(lp, i, low ? GLP_DB : GLP_UP, low ? lower[i - 1] : 0, upper[i - 1]);
    for (int j = 1; j <= n; ++j) {
      index[j] = j;
      row[j] = G(i - 1, j - 1);
    }
    glp_set_mat_row(lp, i, n, index.data(), row.data());
  }
  glp_smcp options;
  glp_init_smcp(&options);
  options.meth = GLP_DUALP, options.tol_bnd = options.tol_dj = 1e-9;
  glp_simplex(lp, &options);
  Oracle out;
  out.status = glp_get_status(lp), out.value = glp_get_obj_val(lp);
  out.x.resize(n), out.dual.resize(m);
  for (int j = 1; j <= n; ++j) out.x[j - 1] = glp_get_col_prim(lp, j);
  for (int i = 1; i <= m; ++i) out.dual[i - 1] = glp_get_row_dual(lp, i);
  glp_delete_prob(lp);
  return out;
}

Vec none(Index m) { return Vec::Constant(m, -INFINITY); }

#endif

}  // namespace

#ifndef PENDULA_GLPK
TEST_CASE("linear programs against GLPK") { MESSAGE("skipped: this build has no GLPK (libglpk-dev)"); }
#else

TEST_CASE("optimum and duals of random linear programs are those of GLPK") {
  std::mt19937_64 g(11);
  for (int round = 0; round < 60; ++round) {
    const Index n = 1 + round % 6, m = 3 * n + round;
    LinearProgram lp;
    lp.G = random_matrix(g, m, n);
    lp.h = random_matrix(g, m, 1).col(0).array() + 1.5;                   // 0 is feasible
    lp.c = -lp.G.transpose() * random_matrix(g, m, 1).col(0).cwiseAbs();  // and the dual is feasible
    const LinearSolution ours = solve(lp);
    const Oracle theirs = glpk(lp.c, lp.G, none(m), lp.h);
    REQUIRE(theirs.status == GLP_OPT);
    REQUIRE(ours.status == LinearSolution::Status::optimal);
    CHECK(ours.value == doctest::Approx(theirs.value).epsilon(1e-8));
    CHECK((ours.x - theirs.x).norm() <= 1e-7 * (1 + theirs.x.norm()));
    Vec dual = Vec::Zero(m);  // GLPK: c = Gᵀ dual, ours: c = -Gᵀλ
    for (std::size_t k = 0; k < ours.active.size(); ++k)
      if (ours.active[k] < m) dual[ours.active[k]] -= ours.multipliers[static_cast<Index>(k)];
    CHECK((dual - theirs.dual).norm() <= 1e-7 * (1 + theirs.dual.norm()));
    CHECK(ours.multipliers.minCoeff() >= -1e-12);
  }
}

TEST_CASE("infeasible and unbounded programs are recognised as by GLPK") {
  std::mt19937_64 g(12);
  int infeasible = 0, unbounded = 0;
  for (int round = 0; round < 60; ++round) {
    const Index n = 2 + round % 3, m = 2 + round % 7;
    LinearProgram lp{Vec(random_matrix(g, n, 1)), random_matrix(g, m, n), Vec(random_matrix(g, m, 1))};
    if (round % 3 == 0) {  // a row and its contradiction
      lp.G.row(1) = -lp.G.row(0);
      lp.h[1] = -lp.h[0] - 0.1;
    }
    const LinearSolution ours = solve(lp);
    const Oracle theirs = glpk(lp.c, lp.G, none(m), lp.h);
    if (ours.status == LinearSolution::Status::optimal) {
      CHECK(theirs.status == GLP_OPT);
    } else if (ours.status == LinearSolution::Status::infeasible) {
      CHECK((theirs.status == GLP_NOFEAS || theirs.status == GLP_INFEAS || theirs.status == GLP_UNDEF));
      ++infeasible;
    } else {
      CHECK(theirs.status != GLP_OPT);
      ++unbounded;
    }
  }
  CHECK(infeasible >= 15);
  CHECK(unbounded >= 10);
}

TEST_CASE("the box of a parameter set is what GLPK finds") {
  std::mt19937_64 g(13);
  for (const Index d : {1, 2, 3, 4, 5}) {
    const Regression r = random_regression(g, 40 * d, d);
    const ParameterSet set = parameter_set(r, -1, 1);
    REQUIRE(set.feasible);
    for (Index i = 0; i < d; ++i)
      for (const double sign : {1.0, -1.0}) {
        const Oracle o = glpk(sign * Vec::Unit(d, i), r.Phi, r.y.array() - 1, r.y.array() + 1);
        REQUIRE(o.status == GLP_OPT);
        CHECK(set.box(i, sign > 0 ? 0 : 1) == doctest::Approx(sign * o.value).epsilon(1e-8));
      }
  }
}

TEST_CASE("smallest feasible bound and least absolute deviations against GLPK") {
  std::mt19937_64 g(14);
  for (int round = 0; round < 10; ++round) {
    const Index d = 1 + round % 4, m = 60;
    const Regression r = random_regression(g, m, d);
    // min γ: |y - Φθ| ≤ γ
    Mat G(2 * m, d + 1);
    G << r.Phi, -Vec::Ones(m), -r.Phi, -Vec::Ones(m);
    Vec h(2 * m);
    h << r.y, -r.y;
    const Oracle o = glpk(Vec::Unit(d + 1, d), G, none(2 * m), h);
    const SmallestBound ours = smallest_bound(r.Phi, r.y);
    CHECK(ours.bound == doctest::Approx(o.value).epsilon(1e-8));
    CHECK((ours.theta - o.x.head(d)).norm() <= 1e-7);
    CHECK(ours.rows.size() == static_cast<std::size_t>(d + 1));
    // min Σ s: |y - Φθ| ≤ s
    Mat A(2 * m, d + m);
    A << r.Phi, -Mat::Identity(m, m), -r.Phi, -Mat::Identity(m, m);
    Vec c = Vec::Zero(d + m);
    c.tail(m).setOnes();
    const Oracle l1 = glpk(c, A, none(2 * m), h);
    const Vec theta = least_absolute(r.Phi, r.y, 1, 1);
    CHECK((r.y - r.Phi * theta).lpNorm<1>() == doctest::Approx(l1.value).epsilon(1e-9));
  }
}

#endif

TEST_CASE("vertices of a parameter set are those of all intersections of d bounds that satisfy the others") {
  std::mt19937_64 g(15);
  for (const Index d : {1, 2, 3}) {
    const Index m = d == 3 ? 12 : 20;
    const Regression r = random_regression(g, m, d);
    const ParameterSet set = parameter_set(r, -1, 1);
    REQUIRE(set.feasible);
    std::vector<Vec> all;
    std::vector<int> pick(static_cast<std::size_t>(2 * m), 0);
    std::fill(pick.begin(), pick.begin() + d, 1);
    do {
      Mat A(d, d);
      Vec b(d);
      Index k = 0;
      for (Index i = 0; i < 2 * m; ++i)
        if (pick[i]) A.row(k) = r.Phi.row(i / 2), b[k++] = r.y[i / 2] + (i % 2 ? 1 : -1);
      const Eigen::FullPivLU<Mat> lu(A);
      if (!lu.isInvertible()) continue;
      const Vec v = lu.solve(b);
      if ((r.y - r.Phi * v).lpNorm<Eigen::Infinity>() <= 1 + 1e-9) all.push_back(v);
    } while (std::prev_permutation(pick.begin(), pick.end()));
    REQUIRE(static_cast<Index>(all.size()) == set.polytope.vertices.rows());
    for (const Vec& v : all)
      CHECK((set.polytope.vertices.rowwise() - v.transpose()).rowwise().norm().minCoeff() <= 1e-9);
  }
}

}  // namespace pendula::oracle_test
