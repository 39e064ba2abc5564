#include "expr/graph/fold.hpp"

#include <charconv>
#include <cmath>
#include <string>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/angle.hpp"
#include "expr/graph/operation.hpp"

namespace pendula {
namespace {

constexpr long max_bits = 1 << 14;   // 2 KB, 4900 digits; larger exact constants are continued as doubles
constexpr long max_exponent = 4096;  // of powers, and of ten in numbers: 10⁴⁰⁹⁶ has 13607 bits

bool small(const mpq_class& q) {
  return static_cast<long>(mpz_sizeinbase(q.get_num_mpz_t(), 2)) < max_bits &&
         static_cast<long>(mpz_sizeinbase(q.get_den_mpz_t(), 2)) < max_bits;
}

std::string show(Op op, Expr a, Expr b) {
  const auto number = [](Expr e) {
    const mpq_class* q = exact_value(e);
    return q && q->get_str().size() < 20 ? q->get_str() : shortest(constant_value(e));
  };
  const OpInfo& row = info(op);
  if (op == Op::div) return number(a) + "/" + number(b);
  if (op == Op::pow) return number(a) + "^" + number(b);
  return row.arity == 1 ? text(row.name, "(", number(a), ")")
                        : text(row.name, "(", number(a), ", ", number(b), ")");
}

[[noreturn]] void undefined(Op op, Expr a, Expr b) {
  if (op == Op::div) throw Error(text("division by zero: ", show(op, a, b)));
  throw Error(text(show(op, a, b), " has no finite real value"));
}

std::optional<mpq_class> exact_power(const mpq_class& base, const mpq_class& exponent) {
  if (exponent.get_den() != 1 || abs(exponent) > max_exponent) return {};
  const long n = exponent.get_num().get_si();
  if (n < 0 && base == 0) return {};
  const auto bits = mpz_sizeinbase(base.get_num_mpz_t(), 2) + mpz_sizeinbase(base.get_den_mpz_t(), 2);
  if (static_cast<long>(bits) * std::labs(n) > max_bits) return {};
  mpz_class num, den;
  mpz_pow_ui(num.get_mpz_t(), base.get_num_mpz_t(), std::labs(n));
  mpz_pow_ui(den.get_mpz_t(), base.get_den_mpz_t(), std::labs(n));
  mpq_class q = n >= 0 ? mpq_class(num, den) : mpq_class(den, num);
  q.canonicalize();
  return q;
}

std::optional<mpq_class> exact_root(const mpq_class& q) {
  if (q < 0 || !mpz_perfect_square_p(q.get_num_mpz_t()) || !mpz_perfect_square_p(q.get_den_mpz_t()))
    return {};
  return mpq_class(sqrt(q.get_num()), sqrt(q.get_den()));
}

/// The largest s with s² | n, by factors up to the bound of trial division.
mpz_class square_part(mpz_class n) {
  mpz_class square = 1;
  for (unsigned long p = 2; p <= largest_trial_divisor && n >= p * p; ++p)
    while (mpz_divisible_ui_p(n.get_mpz_t(), p * p) != 0) {
      n /= p * p;
      square *= p;
    }
  return square;
}

/// √8 = 2 √2, √(3/4) = √3/2; empty if no square can be extracted, or for a measured √9.81.
std::optional<Expr> without_squares(const mpq_class& q) {
  // bits: 19 digits; longer numbers under a root are computed, not written
  constexpr std::size_t longest = 64;
  if (mpz_sizeinbase(q.get_num_mpz_t(), 2) > longest || mpz_sizeinbase(q.get_den_mpz_t(), 2) > longest ||
      mpz_divisible_ui_p(q.get_den_mpz_t(), 5) != 0)
    return {};
  const mpq_class outside(square_part(q.get_num()), square_part(q.get_den()));
  if (outside == 1) return {};
  return Expr(mpq_class(outside.get_num())) * sqrt(Expr(mpq_class(q / (outside * outside)))) /
         Expr(mpq_class(outside.get_den()));
}

/// The exact result of an operation on rationals, if it is rational.
std::optional<mpq_class> exact_result(Op op, const mpq_class& a, const mpq_class& b) {
  switch (op) {
    case Op::neg:
      return -a;
    case Op::add:
      return a + b;
    case Op::sub:
      return a - b;
    case Op::mul:
      return a * b;
    case Op::div:
      return b == 0 ? std::optional<mpq_class>{} : a / b;
    case Op::pow:
      return exact_power(a, b);
    case Op::sqrt:
      return exact_root(a);
    case Op::abs:
      return abs(a);
    case Op::sign:
      return mpq_class(sgn(a));
    case Op::min:
      return a < b ? a : b;
    case Op::max:
      return a > b ? a : b;
    case Op::lt:
      return mpq_class(a < b);
    case Op::le:
      return mpq_class(a <= b);
    case Op::both:
      return mpq_class(a != 0 && b != 0);
    case Op::either:
      return mpq_class(a != 0 || b != 0);
    default:
      if (const auto known = exact_point(op); known && a == known->x) return mpq_class(known->y);
      return {};
  }
}

/// Operations whose exact operands stay symbolic: sin(1), sqrt(2), 2^(1/2).
bool keeps_exact(Op op) { return info(op).style == Style::named || op == Op::pow; }

std::optional<Expr> fold_constants(Op op, Expr a, Expr b) {
  const bool binary = info(op).arity == 2;
  const mpq_class *qa = exact_value(a), *qb = exact_value(b);
  if (qa && (qb || !binary)) {
    if (const auto q = exact_result(op, *qa, *qb); q && small(*q)) return Expr(*q);
    const double value = apply(op, constant_value(a), constant_value(b), 0);
    if (!std::isfinite(value)) undefined(op, a, b);
    if (!binary)
      if (const auto angle = known_angle(op, *qa)) return angle;
    if (op == Op::sqrt)
      if (const auto root = without_squares(*qa)) return root;
    // near the end of the range the double is kept, while there is one
    constexpr double largest = 1 / least_size;
    if (keeps_exact(op) && std::fabs(value) < largest) return {};
    return Expr(value);
  }
  const double value = apply(op, constant_value(a), constant_value(b), 0);
  if (!std::isfinite(value)) undefined(op, a, b);
  return Expr(value);
}

/// The expression without its sign, for -1 · x, -x and negative constants; otherwise empty.
std::optional<Expr> negated(Expr e) {
  if (e.op() == Op::neg) return e.operand(0);
  if (e.is_constant() && constant_value(e) < 0) return -e;
  return {};
}

/// Is e always 1 or 0, true or false? For other x the value of "x and 1" is not x.
bool is_condition(Expr e) {
  return e.op() == Op::lt || e.op() == Op::le || e.op() == Op::both || e.op() == Op::either;
}

std::optional<Expr> fold_sum(Op op, Expr a, Expr b) {
  if (op == Op::add) {
    if (a.is_zero()) return b;
    if (b.is_zero()) return a;
    if (a == b) return Expr(2) * a;
    // c - x and -x + c are not changed, since operands of a sum have no order
    if (const auto n = negated(b); n && !a.is_constant()) return a - *n;
    if (const auto n = negated(a); n && !b.is_constant()) return b - *n;
    return {};
  }
  if (b.is_zero()) return a;
  if (a.is_zero()) return -b;
  if (a == b) return Expr(0);
  if (const auto n = negated(b)) return a + *n;
  return {};
}

std::optional<Expr> fold_product(Expr a, Expr b) {
  if (b.is_constant() && !a.is_constant()) std::swap(a, b);
  if (a.is_zero()) return Expr(0);
  if (a.is_one()) return b;
  if (a == Expr(-1)) return -b;
  if (a == b) return pow(a, Expr(2));
  if (b.op() == Op::neg) return -(a * b.operand(0));
  if (a.op() == Op::neg) return -(a.operand(0) * b);
  const mpq_class* q = exact_value(a);
  if (q && b.op() == Op::mul && exact_value(b.operand(0))) return (a * b.operand(0)) * b.operand(1);
  if (q && b.op() == Op::mul && exact_value(b.operand(1))) return (a * b.operand(1)) * b.operand(0);
  return {};
}

std::optional<Expr> fold_quotient(Expr a, Expr b) {
  if (b.is_constant() && constant_value(b) == 0) throw Error("division by zero");
  if (a.is_zero()) return Expr(0);
  if (b.is_one()) return a;
  if (b == Expr(-1)) return -a;
  if (a == b) return Expr(1);
  if (a.op() == Op::neg) return -(a.operand(0) / b);
  if (b.op() == Op::neg) return -(a / b.operand(0));
  return {};
}

std::optional<Expr> fold_power(Expr a, Expr b) {
  if (b.is_zero()) return Expr(1);
  if (b.is_one()) return a;
  if (a.is_one()) return a;
  const mpq_class* n = exact_value(b);
  if (n && *n == -1) return Expr(1) / a;
  if (n && *n == 2 && (a.op() == Op::neg || a.op() == Op::abs)) return pow(a.operand(0), b);
  if (n && a.op() == Op::sqrt && *n == 2) return a.operand(0);
  if (n && a.op() == Op::pow && n->get_den() == 1) {  // (x^m)^n = x^(mn) for integers
    const mpq_class* m = exact_value(a.operand(1));
    if (m && m->get_den() == 1) return pow(a.operand(0), Expr(mpq_class(*m * *n)));
  }
  return {};
}

}  // namespace

std::optional<Expr> fold(Op op, Expr a, Expr b, Expr c) {
  if (op == Op::ifelse) {
    if (b == c) return b;
    if (a.is_constant()) return a.is_zero() ? c : b;
    return {};
  }
  const bool unary = info(op).arity == 1;
  if (a.is_constant() && (unary || b.is_constant())) return fold_constants(op, a, b);
  switch (op) {
    case Op::neg:
      if (a.op() == Op::neg) return a.operand(0);
      if (a.op() == Op::sub) return a.operand(1) - a.operand(0);
      return {};
    case Op::add:
    case Op::sub:
      return fold_sum(op, a, b);
    case Op::mul:
      return fold_product(a, b);
    case Op::div:
      return fold_quotient(a, b);
    case Op::pow:
      return fold_power(a, b);
    case Op::sin:
    case Op::cos:
    case Op::tan:
      if (const auto q = half_turns(a)) return trigonometric_value(op, *q);
      return {};
    case Op::min:
    case Op::max:
      return a == b ? std::optional<Expr>{a} : std::nullopt;
    case Op::both:
      if (a.is_zero() || b.is_zero()) return Expr(0);
      if (a.is_constant() && is_condition(b)) return b;
      if (b.is_constant() && is_condition(a)) return a;
      return {};
    case Op::either:
      if (a.is_constant() && !a.is_zero()) return Expr(1);
      if (b.is_constant() && !b.is_zero()) return Expr(1);
      if (a.is_zero() && is_condition(b)) return b;
      if (b.is_zero() && is_condition(a)) return a;
      return {};
    default:
      return {};
  }
}

namespace {

/// mantissa · 10^exponent
struct Decimal {
  std::string mantissa;  ///< digits without trailing zeros
  long exponent;
};

/// `precision` digits after the first one; negative: the shortest decimal that reads as this double.
Decimal decimal_of(double size, int precision = -1) {
  char text[64];
  const auto end =
      precision < 0 ? std::to_chars(text, text + sizeof text, size, std::chars_format::scientific)
                    : std::to_chars(text, text + sizeof text, size, std::chars_format::scientific, precision);
  const std::string word(text, end.ptr);
  const auto e = word.find('e');
  Decimal d{word.substr(0, e), std::stol(word.substr(e + 1))};
  if (const auto point = d.mantissa.find('.'); point != std::string::npos) {
    d.exponent -= static_cast<long>(d.mantissa.size() - point - 1);
    d.mantissa.erase(point, 1);
  }
  while (d.mantissa.size() > 1 && d.mantissa.back() == '0') {
    d.mantissa.pop_back();
    ++d.exponent;
  }
  return d;
}

mpq_class rational(const Decimal& d, bool negative) {
  mpz_class power;
  mpz_ui_pow_ui(power.get_mpz_t(), 10, static_cast<unsigned long>(std::labs(d.exponent)));
  const mpz_class mantissa(negative ? "-" + d.mantissa : d.mantissa);
  mpq_class q = d.exponent >= 0 ? mpq_class(mantissa * power) : mpq_class(mantissa, power);
  q.canonicalize();
  return q;
}

constexpr std::size_t typed_digits = 15;  // a double with more digits is taken literally: 2⁶⁰

}  // namespace

std::optional<mpq_class> typed_decimal(double value) {
  constexpr int meant_digits = 10;            // those that arithmetic on typed numbers keeps to last_places
  constexpr std::size_t decimal_digits = 12;  // of 10⁵ computed doubles six have so few digits
  constexpr double last_places = 2;
  if (!std::isfinite(value) || value == 0) return {};
  const double size = std::fabs(value), spacing = std::nextafter(size, HUGE_VAL) - size;
  if (const Decimal d = decimal_of(size); d.mantissa.size() <= decimal_digits) return rational(d, value < 0);
  const Decimal near = decimal_of(size, meant_digits - 1);
  const mpq_class meant = rational(near, false);
  if (abs(meant - mpq_class(size)) > last_places * mpq_class(spacing)) return {};
  return value < 0 ? mpq_class(-meant) : meant;
}

std::optional<mpq_class> simplest_rational(double value) {
  // Two such fractions are 10⁻¹² apart, 4500 ε: hardly any computed number is one by chance.
  constexpr double max_denominator = 1e6;
  if (!std::isfinite(value)) return {};
  if (value == std::floor(value)) {
    // 2⁵³: beyond it 1e24 means 10²⁴, not the double next to it
    constexpr double exactly = 9007199254740992.0;
    if (std::fabs(value) <= exactly) return mpq_class(value);
    const Decimal d = decimal_of(std::fabs(value));
    return d.mantissa.size() > typed_digits ? mpq_class(value) : rational(d, value < 0);
  }
  // Continued fraction. The convergents p/q are best approximations (Hardy & Wright, ch. X); the
  // first one that rounds to the same double is the simplest. A double of this size is an exact
  // quotient of 128-bit numbers.
  const double size = std::fabs(value);
  if (size < 0.5 / max_denominator) return {};
  __extension__ using Wide = unsigned __int128;
  int exponent = 0;
  const double mantissa = std::frexp(size, &exponent);  // not an integer: exponent ≤ 52
  Wide numerator = static_cast<std::uint64_t>(std::ldexp(mantissa, 53)), denominator = Wide(1)
                                                                                       << (53 - exponent);
  Wide p0 = 0, q0 = 1, p1 = 1, q1 = 0;
  while (denominator != 0) {
    const Wide whole = numerator / denominator;
    const Wide p2 = whole * p1 + p0, q2 = whole * q1 + q0;
    if (q2 > static_cast<Wide>(max_denominator)) return {};
    // CAUTION: mpq get_d truncates; the quotient of two doubles rounds correctly as long as both are exact.
    if (p2 < Wide(1) << 53 && static_cast<double>(p2) / static_cast<double>(q2) == size) {
      mpq_class convergent(static_cast<unsigned long>(p2), static_cast<unsigned long>(q2));
      return value < 0 ? mpq_class(-convergent) : convergent;
    }
    const Wide rest = numerator - whole * denominator;
    numerator = denominator;
    denominator = rest;
    p0 = p1;
    q0 = q1;
    p1 = p2;
    q1 = q2;
  }
  return {};
}

Expr parse_number(const std::string& word) {
  std::string number = word;
  std::erase_if(number, [](char ch) { return ch == ' '; });
  const std::string shown = word.size() > 60 ? word.substr(0, 40) + "…" : word;
  const auto bad = [&]() -> Error {
    return Error(text("'", shown, "' is not a number; write 3, 1/3, 0.25 or 1e-3"));
  };
  if (const auto slash = number.find('/'); slash != std::string::npos) {
    const Expr low = parse_number(number.substr(slash + 1));
    if (low.is_zero()) throw Error(text("'", shown, "' divides by zero"));
    return parse_number(number.substr(0, slash)) / low;
  }
  std::string digits;
  long exponent = 0;
  size_t i = 0;
  bool point = false, any = false;
  if (i < number.size() && (number[i] == '-' || number[i] == '+')) digits += number[i++] == '-' ? "-" : "";
  for (; i < number.size() &&
         (std::isdigit(static_cast<unsigned char>(number[i])) || (number[i] == '.' && !point));
       ++i) {
    if (number[i] == '.') {
      point = true;
    } else {
      digits += number[i];
      any = true;
      if (point) --exponent;
    }
  }
  if (!any) throw bad();
  if (i < number.size() && (number[i] == 'e' || number[i] == 'E')) {
    char* end = nullptr;
    exponent += std::strtol(number.c_str() + i + 1, &end, 10);
    if (end == number.c_str() + i + 1) throw bad();
    i = end - number.c_str();
  }
  if (i != number.size() || std::labs(exponent) > max_exponent) throw bad();
  mpz_class scale;
  mpz_ui_pow_ui(scale.get_mpz_t(), 10, std::labs(exponent));
  const mpz_class mantissa(digits, 10);  // base 10, since GMP would read "025" as octal
  mpq_class q = exponent < 0 ? mpq_class(mantissa, scale) : mpq_class(mantissa * scale);
  q.canonicalize();
  if (!std::isfinite(q.get_d()))
    throw Error(text("'", shown, "' is too large for a number (at most 1.8e308): choose other units"));
  return Expr(q);
}

}  // namespace pendula
