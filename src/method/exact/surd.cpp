#include "method/exact/surd.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/limits/stack.hpp"

namespace pendula::integrate {
namespace {

long common_radicand(const Surd& x, const Surd& y) {
  PENDULA_ASSERT(x.radicand() == y.radicand() || x.is_rational() || y.is_rational(), "surds of two fields");
  return x.is_rational() ? y.radicand() : x.radicand();
}

/// √n = factor·√d with square-free d. Empty if n is too large for trial division.
std::optional<Surd> root_of_integer(mpz_class n) {
  if (n < 0 || n > mpz_class("1000000000000")) return {};
  mpz_class factor = 1;
  for (long p = 2; p * p <= n; ++p)
    while (n % (p * p) == 0) {
      n /= p * p;
      factor *= p;
    }
  if (n == 1) return Surd(mpq_class(factor));
  return Surd(0, mpq_class(factor), n.get_si());
}

std::optional<Surd> root(const Surd& x) {
  if (!x.is_rational() || x.sign() < 0) return {};
  const mpq_class& q = x.rational_part();
  std::optional<Surd> result = root_of_integer(q.get_num() * q.get_den());
  if (result) result = *result / Surd(mpq_class(q.get_den()));
  return result;
}

std::optional<Surd> power(const Surd& base, const mpq_class& exponent) {
  constexpr int most = 100;  // factors: a choice, as the fractions grow
  if (exponent.get_den() != 1 || abs(exponent) > most) return {};
  const long n = std::labs(exponent.get_num().get_si());
  Surd result(1);
  for (long i = 0; i < n; ++i) result *= base;
  if (exponent >= 0) return result;
  if (result.is_zero()) return {};
  return Surd(1) / result;
}

std::optional<Surd> binary(Op op, const Surd& x, const Surd& y) {
  const Surd pair[] = {x, y};
  if (!one_field(pair)) return {};
  switch (op) {
    case Op::add:
      return x + y;
    case Op::sub:
      return x - y;
    case Op::mul:
      return x * y;
    default:
      if (y.is_zero()) return {};
      return x / y;
  }
}

}  // namespace

int Surd::sign() const {
  const int a = sgn(a_), b = sgn(b_);
  if (a == b || b == 0) return a;
  if (a == 0) return b;
  const mpq_class difference = a_ * a_ - b_ * b_ * d_;  // |a| against |b|√d
  return sgn(difference) * a;
}

Surd operator+(const Surd& x, const Surd& y) { return Surd(x.a_ + y.a_, x.b_ + y.b_, common_radicand(x, y)); }

Surd operator-(const Surd& x, const Surd& y) { return Surd(x.a_ - y.a_, x.b_ - y.b_, common_radicand(x, y)); }

Surd operator*(const Surd& x, const Surd& y) {
  const long d = common_radicand(x, y);
  return Surd(x.a_ * y.a_ + x.b_ * y.b_ * d, x.a_ * y.b_ + x.b_ * y.a_, d);
}

Surd operator/(const Surd& x, const Surd& y) {
  PENDULA_ASSERT(!y.is_zero(), "division of a surd by zero");
  const mpq_class norm = y.a_ * y.a_ - y.b_ * y.b_ * y.d_;
  return x * Surd(y.a_ / norm, -y.b_ / norm, y.d_);
}

Expr Surd::expr() const {
  if (b_ == 0) return Expr(a_);
  const mpz_class numerator = abs(b_.get_num());
  Expr term = sqrt(Expr(d_));
  if (numerator != 1) term = Expr(mpq_class(numerator)) * term;
  if (b_.get_den() != 1) term = term / Expr(mpq_class(b_.get_den()));
  if (a_ == 0) return sgn(b_) < 0 ? -term : term;
  return sgn(b_) < 0 ? Expr(a_) - term : Expr(a_) + term;
}

Real Surd::real(mp_bitcnt_t bits) const {
  if (b_ == 0) return Real(a_, bits);
  return Real(Real(a_, bits) + Real(b_, bits) * sqrt(Real(d_, bits)), bits);
}

std::optional<Surd> exact_surd(Expr e) {
  check_stack();
  if (e.is_constant()) {
    double error = 0;
    const mpq_class* exact = exact_value(e);
    if (!exact) return {};
    precise_value(e, 64, error);
    if (error > 0) return {};
    return Surd(*exact);
  }
  if (e.op() == Op::neg || e.op() == Op::sqrt) {
    const auto x = exact_surd(e.operand(0));
    if (!x) return {};
    return e.op() == Op::neg ? -*x : root(*x);
  }
  if (e.op() != Op::add && e.op() != Op::sub && e.op() != Op::mul && e.op() != Op::div && e.op() != Op::pow)
    return {};
  const auto x = exact_surd(e.operand(0)), y = exact_surd(e.operand(1));
  if (!x || !y) return {};
  if (e.op() != Op::pow) return binary(e.op(), *x, *y);
  if (!y->is_rational()) return {};
  return power(*x, y->rational_part());
}

bool one_field(std::span<const Surd> numbers) {
  long d = 0;
  for (const Surd& number : numbers) {
    if (number.is_rational() || number.radicand() == d) continue;
    if (d != 0) return false;
    d = number.radicand();
  }
  return true;
}

}  // namespace pendula::integrate
