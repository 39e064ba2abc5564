// Random DAEs whose index and degrees of freedom are known by construction: transformed Weierstrass forms
// S (diag(I, N) w′ - diag(J, I) w - f) = 0, w = T x (Kunkel & Mehrmann 2006, Thm 2.7), and nonlinear changes
// of variables and time-dependent mixing of them. The roads must agree: construction, derivative array,
// regularised structure.
#include <doctest/doctest.h>

#include <cstdlib>
#include <random>

#include "dae/index/array_index.hpp"
#include "dae/model/make_model.hpp"
#include "dae/regularise/regularise.hpp"
#include "expr/print/print.hpp"
#include "tests/dae/problems.hpp"

namespace pendula::random_dae_test {

using namespace pendula::dae;
using namespace pendula::problems;

namespace {

/// A part of so many models; all of them where PENDULA_LONG is set (./dev long).
int part_of(int trials) { return std::getenv("PENDULA_LONG") ? trials : (trials + 2) / 3; }

struct Known {
  ModelPtr model;
  int index, dof;
};

class Generator {
 public:
  Generator(unsigned seed, int size) : random_(seed), size_(size) {}

  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  Expr rational() {
    const int above = below(2 * size_ + 1) - size_;  // in this order, whatever the compiler
    return Expr(above) / Expr(1 + below(size_));
  }

  /// Unit lower triangular times unit upper triangular: regular, with rational entries.
  MatX regular(int n) {
    MatX L = MatX::Identity(n, n), U = MatX::Identity(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) L(i, j) = rational(), U(j, i) = rational();
    return L * U;
  }

  /// F = diag(I, N) w′ - diag(J, I) w - f(t) for given w(t): `dof` differential rows, nilpotent blocks.
  VecX weierstrass(const VecX& w, int dof, const std::vector<int>& blocks) {
    VecX F(w.size());
    const Expr t = time_symbol();
    for (int i = 0; i < dof; ++i) {
      F[i] = total_derivative(w[i]) - Expr(below(3)) * sin(t);
      for (int j = 0; j < dof; ++j) F[i] -= rational() * w[j];
    }
    Eigen::Index at = dof;
    for (int size : blocks)
      for (int i = 0; i < size; ++i, ++at)
        F[at] = (i + 1 < size ? total_derivative(w[at + 1]) : Expr(0)) - w[at] - Expr(1 + below(3)) * sin(t) -
                rational();
    return F;
  }

 private:
  std::mt19937 random_;
  int size_;  // of numerators and denominators
};

ModelPtr model_of(const VecX& F, const VecX& x) {
  Block b{VecX::Zero(F.size()), F, ""};
  ModelOptions options;
  options.x.assign(x.data(), x.data() + x.size());
  return make_model({b}, options);
}

enum class Disguise { linear, nonlinear, mixing };

Known disguised(Generator& g, Disguise how, int largest) {
  const int dof = g.below(3);
  std::vector<int> blocks{1 + g.below(largest)};
  if (g.below(2)) blocks.push_back(1 + g.below(blocks[0]));
  int n = dof;
  for (int b : blocks) n += b;
  const VecX x = column(symbol_vector(pendula::Kind::variable, "x", n));
  VecX w = g.regular(n) * x;
  if (how == Disguise::nonlinear)  // w + q(w) with strictly triangular q: invertible everywhere
    for (int i = n - 1; i > 0; --i) w[i] += Expr(mpq_class(1, 3)) * w[i - 1] * w[i - 1];
  VecX F = g.regular(n) * g.weierstrass(w, dof, blocks);
  if (how == Disguise::mixing) {  // unimodular in t and, where one row allows it, in x
    const Expr t = time_symbol();
    for (int i = 0; i + 1 < n; ++i) F[i] += sin(t) * F[i + 1];
    for (int i = n - 1; i > 0; --i) F[i] += (t + x[0]) * F[i - 1];
  }
  return {model_of(F, x), blocks[0], dof};
}

/// True if the derivative array decided; what it says must then be right. Nonlinear models may be left open
/// (no clear gap, no point found), never answered wrongly.
bool check_roads(const Known& k) {
  const ArrayResult r = derivative_array(*k.model);
  CAPTURE(r.text);
  CAPTURE(r.covered);
  const bool decided = r.verdict == ArrayVerdict::determined;
  if (decided) {
    CHECK(r.index == k.index);
    CHECK(r.dof == k.dof);
  } else {
    CHECK((r.verdict == ArrayVerdict::not_covered || r.verdict == ArrayVerdict::varying));
  }
  const Structure s = structure_of(equations_of(*k.model));
  if (s.regular) {
    CHECK(s.offsets.value == k.dof);
    CHECK(s.offsets.index() >= k.index);
  } else if (const auto regularised = regularise(k.model)) {
    CHECK(regularised->dof == k.dof);
    CHECK(regularised->differentiations >= k.index);
  }
  return decided;
}

}  // namespace

TEST_CASE("linear: derivative array and regularised structure find the index and freedom of construction") {
  Generator g(20261121, 3);
  int regularised = 0;
  for (int trial = 0; trial < part_of(30); ++trial) {
    CAPTURE(trial);
    const Known k = disguised(g, Disguise::linear, 4);
    CHECK(check_roads(k));
    const ArrayResult r = derivative_array(*k.model);
    CHECK(r.exact);
    CHECK(static_cast<int>(r.constraints.size()) == r.conditions);
    const auto model = regularise(k.model);
    if (!structure_of(equations_of(*k.model)).regular) {
      REQUIRE(model);  // constant coefficients: elimination always succeeds
      CHECK(model->nonzero.empty());
      ++regularised;
    }
  }
  CHECK(regularised > part_of(10));
}

TEST_CASE("nonlinear changes of variables keep index and freedom") {
  Generator g(7, 1);
  int decided = 0;
  for (int trial = 0; trial < part_of(12); ++trial) {
    CAPTURE(trial);
    decided += check_roads(disguised(g, Disguise::nonlinear, 3));
  }
  CHECK(decided >= part_of(9));
}

TEST_CASE("mixing of the equations that depends on time and state keeps index and freedom") {
  Generator g(11, 1);
  const int trials = part_of(15);
  int decided = 0;
  for (int trial = 0; trial < trials; ++trial) {
    CAPTURE(trial);
    decided += check_roads(disguised(g, Disguise::mixing, 3));
  }
  CHECK(decided >= trials * 13 / 15);
}

}  // namespace pendula::random_dae_test
