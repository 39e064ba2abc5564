#include "lti/matrices.hpp"

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "expr/generic/generic.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::lti {

Field field(std::span<const Expr> entries) {
  constexpr std::size_t most_bits = 256;  // see the head of matrices.hpp
  Field f = Field::exact;
  mpz_class common = 1;
  for (Expr e : entries) {
    if (!e.is_constant()) return Field::symbolic;
    if (f == Field::numeric) continue;
    const mpq_class* q = exact_value(e);
    if (q && common % q->get_den() != 0) common = lcm(common, q->get_den());
    if (!q || mpz_sizeinbase(common.get_mpz_t(), 2) > most_bits) f = Field::numeric;
  }
  return f;
}

MatX product(const MatX& a, const MatX& b) {
  PENDULA_ASSERT(a.cols() == b.rows(), "a product of matrices whose sizes differ");
  constexpr Index large = 10'000;  // products of numbers; smaller ones keep their order of summation
  if (a.size() * b.cols() > large && common(field(a), field(b)) == Field::numeric)
    return expressions(Mat(numbers(a) * numbers(b)));
  MatX c = MatX::Zero(a.rows(), b.cols());
  for (Index i = 0; i < a.rows(); ++i) {
    poll_interrupt();
    for (Index k = 0; k < a.cols(); ++k)
      if (!a(i, k).is_zero())
        for (Index j = 0; j < b.cols(); ++j)
          if (!b(k, j).is_zero()) c(i, j) += a(i, k) * b(k, j);
  }
  return c;
}

MatX hstack(const MatX& a, const MatX& b) {
  MatX c(a.rows(), a.cols() + b.cols());
  c << a, b;
  return c;
}

MatX vstack(const MatX& a, const MatX& b) {
  MatX c(a.rows() + b.rows(), a.cols());
  c << a, b;
  return c;
}

MatX block_diagonal(const MatX& a, const MatX& b) {
  MatX c = MatX::Zero(a.rows() + b.rows(), a.cols() + b.cols());
  c.topLeftCorner(a.rows(), a.cols()) = a;
  c.bottomRightCorner(b.rows(), b.cols()) = b;
  return c;
}

MatX scaled(Expr factor, const MatX& m) {
  return m.unaryExpr([&](Expr e) { return factor * e; });
}

MatX tidy(const MatX& m) {
  return m.unaryExpr([](Expr e) { return e.is_constant() || e.is_symbol() ? e : simplify(e); });
}

std::optional<MatX> solve(const MatX& a, const MatX& b) {
  if (a.rows() == 0) return MatX(b);
  const Field f = common(field(a), field(b));
  try {
    constexpr Index most_exact = 40;  // as for transfer functions: 0.1 s
    if (f == Field::numeric || (f == Field::exact && a.rows() > most_exact))
      return expressions(linalg::solve(numbers(a), numbers(b)));
    return tidy(linalg::solve(a, b));
  } catch (const Error&) {
    return {};
  }
}

MatX expressions(const Mat& m) {
  MatX e(m.rows(), m.cols());
  for (Index j = 0; j < m.cols(); ++j) {
    poll_interrupt();  // a million numbers take a second
    for (Index i = 0; i < m.rows(); ++i) e(i, j) = m(i, j) == 0 ? Expr(0) : Expr(m(i, j));
  }
  return e;
}

dae::RationalMatrix rational(const MatX& m) {
  dae::RationalMatrix r(static_cast<int>(m.rows()), static_cast<int>(m.cols()));
  for (int i = 0; i < r.rows(); ++i)
    for (int j = 0; j < r.cols(); ++j) {
      const mpq_class* q = exact_value(m(i, j));
      r(i, j) = q ? *q : mpq_class(constant_value(m(i, j)));
    }
  return r;
}

MatX rounded(const MatX& m) {
  return m.unaryExpr([](Expr e) { return e.is_constant() ? Expr(constant_value(e)) : e; });
}

double number(Expr e) {
  if (e.is_constant()) return constant_value(e);
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind != Kind::constant)
      throw Error(text("'", to_text(leaf), "' has no value here; give it one with G:with{ ",
                       symbol_of(leaf).name, " = 1 }"));
  return evaluate({&e, 1}, {})[0];
}

Mat numbers(const MatX& m) {
  return m.unaryExpr([](Expr e) { return number(e); });
}

Substitution defaults(std::span<const Expr> all) {
  Substitution values;
  for (Expr leaf : leaves(all)) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::constant) {
      values[leaf] = Expr(number(leaf));
    } else if (s.kind != Kind::parameter) {
      throw Error(
          text("'", to_text(leaf), "' is not a parameter; a linear system has constant coefficients"));
    } else if (!s.value) {
      throw Error(
          text("the parameter '", s.name, "' has no value; give it one with G:with{ ", s.name, " = 1 }"));
    } else {
      values[leaf] = *s.value;
    }
  }
  return values;
}

}  // namespace pendula::lti
