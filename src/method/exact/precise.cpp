#include "method/exact/precise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {
namespace {

/// Half a unit in the last digit of a fraction with denominator 2ᵃ5ᵇ above 10¹², relative to its value; 0 for
/// other fractions.
double decimal_error(const mpq_class& value) {
  if (value.get_den() < mpz_class("1000000000000")) return 0;
  mpz_class denominator = value.get_den();
  int digits = 0;
  for (; denominator != 1; ++digits) {
    mpz_class common;
    mpz_gcd_ui(common.get_mpz_t(), denominator.get_mpz_t(), 10);
    if (common == 1) return 0;
    denominator /= common;
  }
  return 0.5 * std::pow(10.0, -digits) / std::fabs(value.get_d());
}

class Evaluation {
 public:
  Evaluation(mp_bitcnt_t bits, double& error) : bits_(bits), error_(error) {}

  Real value(Expr e) {
    if (const mpq_class* exact = exact_value(e)) {
      error_ = std::max(error_, decimal_error(*exact));
      return Real(*exact, bits_);
    }
    switch (e.op()) {
      case Op::neg:
        return Real(-value(e.operand(0)), bits_);
      case Op::add:
        return Real(value(e.operand(0)) + value(e.operand(1)), bits_);
      case Op::sub:
        return Real(value(e.operand(0)) - value(e.operand(1)), bits_);
      case Op::mul:
        return Real(value(e.operand(0)) * value(e.operand(1)), bits_);
      case Op::div:
        return quotient(e);
      case Op::sqrt:
        return root(e);
      case Op::pow:
        return power(e);
      default:
        return in_doubles(e);
    }
  }

 private:
  Real quotient(Expr e) {
    const Real divisor = value(e.operand(1));
    if (divisor == 0) throw Error("division by zero");
    return Real(value(e.operand(0)) / divisor, bits_);
  }

  Real root(Expr e) {
    const Real radicand = value(e.operand(0));
    if (radicand < 0) throw Error("square root of a negative number");
    return Real(sqrt(radicand), bits_);
  }

  Real power(Expr e) {
    const mpq_class* exponent = exact_value(e.operand(1));
    constexpr int most = 1000;  // factors: a choice
    if (!exponent || exponent->get_den() != 1 || abs(*exponent) > most) return in_doubles(e);
    const Real base = value(e.operand(0));
    Real result(1, bits_);
    for (long i = std::labs(exponent->get_num().get_si()); i > 0; --i) result *= base;
    if (*exponent >= 0) return result;
    if (result == 0) throw Error("division by zero");
    return Real(1 / result, bits_);
  }

  Real in_doubles(Expr e) {
    const double number = evaluate(std::span(&e, 1), {})[0];  // throws on symbols
    if (!std::isfinite(number)) throw Error("not a finite number");
    error_ = std::max(error_, eps / 2);
    return Real(number, bits_);
  }

  mp_bitcnt_t bits_;
  double& error_;
};

}  // namespace

Real precise_value(Expr e, mp_bitcnt_t bits, double& error) { return Evaluation(bits, error).value(e); }

double nearest_double(const Real& value) {
  const double toward_zero = value.get_d();  // mpf truncates
  const double away = std::nextafter(toward_zero, sgn(value) < 0 ? -std::numeric_limits<double>::infinity()
                                                                 : std::numeric_limits<double>::infinity());
  if (!std::isfinite(away)) return away;  // GMP aborts if a Real is constructed from an infinity
  const mp_bitcnt_t bits = value.get_prec() + 64;
  const Real below(abs(value - Real(toward_zero, bits)), bits), above(abs(Real(away, bits) - value), bits);
  return above < below ? away : toward_zero;
}

double rounded_coefficient(const Real& value) {
  const double rounded = nearest_double(value);
  if (!std::isfinite(rounded))
    throw Error("a coefficient of the method is beyond the range of doubles (1.8e308)");
  return rounded;
}

}  // namespace pendula::integrate
