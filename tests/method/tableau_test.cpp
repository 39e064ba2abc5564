// Tableaus: order conditions, collocation, properties, text, and what the constructor refuses.
#include "method/tableau.hpp"

#include <cmath>

#include <doctest/doctest.h>

#include "base/error.hpp"
#include "method/collocation.hpp"
#include "method/stability.hpp"
#include "tests/integrate/problems.hpp"

namespace pendula::tableau_test {

using namespace pendula::test;

namespace {

std::string refusal(const std::string& drawing) {
  try {
    TableauData data = parse_tableau(drawing);
    data.name = "x";
    Tableau{data};
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("tableau: order by rooted trees, also of methods that are exact on linear problems only") {
  CHECK(euler()->order() == 1);
  CHECK(rk4()->order() == 4);
  CHECK(trapezoid()->order() == 2);
  CHECK(implicit_euler()->order() == 1);
  // Jameson's scheme: R(z) agrees with exp to order 4, the bushy trees already fail at order 3.
  CHECK(drawn("0 | \n 1/4 | 1/4 \n 1/3 | 0 1/3 \n 1/2 | 0 0 1/2 \n | 0 0 0 1")->order() == 2);
  // Butcher's sixth order method with seven stages (Butcher, Numerical Methods for ODEs, 2nd ed., §326).
  CHECK(drawn("0 | \n 1/3 | 1/3 \n 2/3 | 0 2/3 \n 1/3 | 1/12 1/3 -1/12 \n 5/6 | 25/48 -55/24 35/48 15/8 \n"
              "1/6 | 3/20 -11/24 -1/8 1/2 1/10 \n 1 | -261/260 33/13 43/156 -118/39 32/195 80/39 \n"
              "| 13/200 0 11/40 11/40 4/25 4/25 13/200")
            ->order() == 6);
}

TEST_CASE("tableau: Gauss methods have order 2s, stage order s, and are symplectic and symmetric") {
  for (int s : {1, 2, 3, 4, 5, 7, 10, 20}) {
    CAPTURE(s);
    const Tableau rk = gauss(s);
    CHECK(rk.stages() == s);
    CHECK(rk.order() == 2 * s);
    CHECK(rk.stage_order() == s);
    CHECK(rk.is_symplectic());
    CHECK(rk.is_symmetric());
    CHECK(rk.is_collocation());
    CHECK(rk.is_stiffly_accurate() == false);
    CHECK(Stability(rk).at_infinity() == (s % 2 ? -1 : 1));
  }
}

TEST_CASE("tableau: Radau IIA methods have order 2s - 1 and R(∞) = 0") {
  for (int s : {1, 2, 3, 4, 6, 9}) {
    CAPTURE(s);
    const Tableau rk = radau(s);
    CHECK(rk.order() == 2 * s - 1);
    CHECK(rk.is_collocation());
    CHECK(rk.is_stiffly_accurate());
    CHECK(Stability(rk).at_infinity() == 0);
    CHECK(rk.c()[s - 1] == 1);
  }
}

TEST_CASE(
    "tableau: nodes of gauss(s) are the doubles nearest to the zeros of the shifted Legendre polynomial") {
  // The exact P_s(τ) = Σ_k (-1)^(s+k) C(s,k) C(s+k,k) τ^k changes sign between the two neighbours of each
  // node halfway to the next double: no tolerance is needed.
  for (int s = 1; s <= 20; ++s) {
    CAPTURE(s);
    std::vector<mpz_class> coefficients;
    for (int k = 0; k <= s; ++k) {
      mpz_class a, b;
      mpz_bin_uiui(a.get_mpz_t(), s, k);
      mpz_bin_uiui(b.get_mpz_t(), s + k, k);
      coefficients.push_back((s + k) % 2 ? mpz_class(-a * b) : mpz_class(a * b));
    }
    const auto sign = [&](const mpq_class& tau) {
      mpq_class value = 0;
      for (int k = s; k >= 0; --k) value = value * tau + coefficients[k];
      return sgn(value);
    };
    const Vec nodes = gauss(s).c();
    for (double node : nodes) {
      const mpq_class below = (mpq_class(node) + mpq_class(std::nextafter(node, 0.0))) / 2;
      const mpq_class above = (mpq_class(node) + mpq_class(std::nextafter(node, 1.0))) / 2;
      CHECK(sign(below) * sign(above) <= 0);
    }
  }
}

TEST_CASE("tableau: the exact forms of small methods are the collocation of their nodes") {
  for (const Tableau& rk : {gauss(2), gauss(3), radau(2), radau(3)}) {
    CAPTURE(rk.name());
    const Tableau again = collocation(entries(*rk.data().c));
    // Both are the nearest doubles of numbers known to 256 bits.
    CHECK((again.A() - rk.A()).isZero(0));
    CHECK((again.b() - rk.b()).isZero(0));
  }
  const Expr nodes[] = {parse_number("1/3"), 1};
  const Tableau radau2 = collocation(nodes);
  CHECK(radau2.data().A(0, 1) == parse_number("-1/12"));  // exact, since the nodes are fractions
  CHECK(radau2.order() == 3);
}

TEST_CASE("tableau: weights and stages of a hundred-stage method still satisfy their conditions in doubles") {
  const Tableau rk = gauss(100);
  // 100 terms of size ≤ 0.016 that sum to 1, each rounded once: below 100 · ε/2 · 0.016.
  CHECK(std::fabs(rk.b().sum() - 1) <= 2e-16 + 100 * 1.2e-16 * 0.016);
  // aᵢⱼ ≤ 0.016 likewise; the sum itself rounds at most 100 times at size 1.
  CHECK((rk.A().rowwise().sum() - rk.c()).cwiseAbs().maxCoeff() <= 100 * 1.2e-16);
}

TEST_CASE("tableau: derived properties") {
  CHECK(rk4()->is("explicit"));
  CHECK(std::isinf(Stability(*rk4()).at_infinity()));
  CHECK(implicit_euler()->is("diagonally implicit"));
  CHECK(Stability(*implicit_euler()).at_infinity() == 0);
  CHECK(trapezoid()->is("symmetric"));
  CHECK(Stability(*trapezoid()).at_infinity() == -1);
  CHECK(trapezoid()->is("FSAL"));
  CHECK(gauss(1).is("diagonally implicit"));
  CHECK_FALSE(gauss(2).is("diagonally implicit"));
  CHECK_THROWS_WITH_AS(
      rk4()->is("symplektic"),
      "unknown property 'symplektic'. Did you mean 'symplectic'? Known are: explicit, implicit, diagonally "
      "implicit, singly diagonally implicit, explicit first stage, FSAL, stiffly accurate, collocation, "
      "A-stable, A(α)-stable, L-stable, I-stable, algebraically stable, symplectic, symmetric",
      Error);
}

TEST_CASE("tableau: entries are exact expressions") {
  CHECK(parse_entry("1/2") == parse_number("1/2"));
  CHECK(parse_entry("-1/2+3*0.25") == parse_number("1/4"));
  CHECK(parse_entry("-2^2") == Expr(-4));
  CHECK(parse_entry("2^-1") == parse_number("1/2"));
  CHECK(parse_entry("(3-sqrt(3))/6") == (Expr(3) - sqrt(Expr(3))) / Expr(6));
  CHECK(parse_entry(" sqrt( 4 ) ") == Expr(2));
  CHECK_THROWS_WITH_AS(parse_entry("1/x"),
                       "'1/x' is not a number: expected a number, pi or a function such as sqrt at 'x'",
                       Error);
  CHECK_THROWS_WITH_AS(parse_entry("(1"), "'(1' is not a number: expected ')' at its end", Error);
  CHECK_THROWS_WITH_AS(parse_entry("1 2"), "'1 2' is not a number: expected an operator or the end at '2'",
                       Error);
  CHECK_THROWS_AS(parse_entry(""), Error);
  CHECK_THROWS_AS(parse_entry("1/0"), Error);
  CHECK_THROWS_AS(parse_entry(std::string(100000, '(')), Error);
  CHECK_THROWS_AS(parse_entry(std::string(100000, '-')), Error);
}

TEST_CASE("tableau: what the constructor refuses, and why") {
  CHECK(refusal("0 | \n 1/2 | 1/2 \n 3/4 | 0 3/4 \n 1 | 2/9 1/3 5/9 \n | 2/9 1/3 4/9 0") ==
        "tableau 'x': row 4 of A sums to 10/9, but c[4] = 1");
  CHECK(refusal("0 | \n 1 | 1 \n | 1/2 1/3") == "tableau 'x': b sums to 5/6, not 1");
  CHECK(refusal("0 | \n 1 | 1 \n | 1/2 1/2 \n | 1 1") == "tableau 'x': bhat sums to 2, not 1");
  CHECK(refusal("0 | \n 1 | 1 \n | 1") == "line 3 has 1 weight for 2 stages");
  CHECK(refusal("0 | \n 1 | 1 0 0 \n | 1 0") == "line 2 has 3 entries for 2 stages");
  CHECK(refusal("0 | 0") == "the weights are missing; add a last line '| b1 b2 …'");
  CHECK(refusal("") == "no line of the form 'c | a …' found");
  CHECK(refusal("0 0 \n | 1") == "line 1 needs one '|' between c and the row of A: '0 0 '");
  CHECK(refusal("0 | y \n | 1") ==
        "line 1: 'y' is not a number: expected a number, pi or a function such as sqrt at 'y'");
  TableauData data = parse_tableau("0 | \n 1 | 1 \n | 1/2 1/2");
  data.name = "heun";
  data.order = 3;
  CHECK_THROWS_WITH_AS(Tableau{data}, "tableau 'heun': order 3 is claimed, but the order conditions give 2",
                       Error);
  data.order.reset();
  data.b = VecX::Constant(3, Expr(1));
  CHECK_THROWS_WITH_AS(Tableau{data}, "tableau 'heun': b has 3 entries, but A has 2 rows", Error);
  data.b = VecX::Constant(2, symbol(Kind::parameter, "gamma"));
  CHECK_THROWS_WITH_AS(Tableau{data}, doctest::Contains("tableau 'heun': b[1] is not a number"), Error);
  CHECK_THROWS_WITH_AS(gauss(0), "gauss(0): the number of stages must be between 1 and 100", Error);
  CHECK_THROWS_AS(gauss(101), Error);
  const Expr twice[] = {parse_number("1/2"), parse_number("0.5")};
  CHECK_THROWS_WITH_AS(collocation(twice), "nodes 1 and 2 are equal; the nodes must be distinct", Error);
}

TEST_CASE("tableau: published decimals are taken for the rounded numbers that they are") {
  // Ralston's method with 16 digits instead of 2/3: order 2 up to rounding.
  CHECK(drawn("0 | \n 0.6666666666666667 | 0.6666666666666667 \n | 0.25 0.75")->order() == 2);
  // Four digits are not rounding.
  CHECK(drawn("0 | \n 0.6667 | 0.6667 \n | 0.25 0.75")->order() == 1);
}

TEST_CASE("tableau: drawn as in a book") {
  CHECK(rk4()->str() ==
        "rk4: 4 stages, order 4, explicit\n\n"
        "0   │\n1/2 │ 1/2\n1/2 │ 0    1/2\n1   │ 0    0    1\n"
        "────┼───────────────────\n    │ 1/6  1/3  1/3  1/6\n");
  CHECK(implicit_euler()->latex() == "\\begin{array}{c|c}\n1 & 1 \\\\\n\\hline\n & 1\n\\end{array}");
}

}  // namespace pendula::tableau_test
