// The rules of simplify for functions. All hold over the reals wherever the left side is defined.
#include <cmath>

#include "expr/graph/angle.hpp"
#include "expr/graph/operation.hpp"
#include "expr/rewrite/rewrite_forms.hpp"

namespace pendula {
namespace {

using Args = std::vector<SumId>;

// ── functions ──────────────────────────────────────────────────────────────────────────────────────────────

std::optional<SumId> fold_parity(Simplifier& s, Op op, const Args& x) {
  const Parity p = parity(op);
  if (p == Parity::none || !s.leads_negative(x[0])) return {};
  const SumId positive = s.function(op, {s.minus(x[0])});
  return p == Parity::even ? positive : s.minus(positive);
}

/// outer(inner(x)) = x; acosh(cosh x) = |x|.
struct Inverse {
  Op outer, inner;
};
constexpr Inverse inverses[] = {{Op::log, Op::exp},    {Op::exp, Op::log},    {Op::sin, Op::asin},
                                {Op::cos, Op::acos},   {Op::tan, Op::atan},   {Op::sinh, Op::asinh},
                                {Op::cosh, Op::acosh}, {Op::tanh, Op::atanh}, {Op::asinh, Op::sinh},
                                {Op::atanh, Op::tanh}};

std::optional<SumId> cancel_inverse(Simplifier& s, Op op, const Args& x) {
  const auto a = s.lone_atom(x[0]);
  if (!a) return {};
  if (op == Op::acosh && s.is_function(*a, Op::cosh)) return s.function(Op::abs, {s.atom(*a).args[0]});
  for (const Inverse& pair : inverses)
    if (pair.outer == op && s.is_function(*a, pair.inner)) return s.atom(*a).args[0];
  return {};
}

/// 1 + c y².
SumId one_and_square(Simplifier& s, SumId y, int c) {
  Term square{Number(c), {}};
  s.multiply(square, y, 2);
  Sum sum = s.sum(s.product(std::move(square)));
  sum.push_back(Term{1, {}});
  return s.intern(std::move(sum));
}

/// A function of an inverse function as an algebraic term, which repeats the argument; only if that
/// is not longer.
std::optional<SumId> unless_longer(Simplifier& s, Op op, const Args& x, Term value) {
  const SumId algebraic = s.product(std::move(value));
  const bool longer = s.traits(algebraic).tokens > s.traits(s.single(s.function_atom(op, x))).tokens;
  return longer ? std::nullopt : std::optional(algebraic);
}

/// sin(2 asin y) = 2 y √(1 - y²), cos(2 asin y) = 1 - 2 y², with atan y over 1 + y².
std::optional<SumId> twice_an_inverse(Simplifier& s, Op op, const Args& x) {
  const Sum& sum = s.sum(x[0]);
  if (op == Op::tan || sum.size() != 1 || sum[0].factors.size() != 1 || sum[0].factors[0].exponent != 1 ||
      !sum[0].coefficient.is(2))
    return {};
  const AtomId a = sum[0].factors[0].atom;
  const bool of_tangent = s.is_function(a, Op::atan), of_cosine = s.is_function(a, Op::acos);
  if (!of_tangent && !of_cosine && !s.is_function(a, Op::asin)) return {};
  const SumId y = s.atom(a).args[0], rest = one_and_square(s, y, of_tangent ? 1 : -1);
  Term value{Number(op == Op::sin ? 2 : of_cosine ? -1 : 1), {}};
  if (op == Op::sin) {
    s.multiply(value, y, 1);
    s.multiply(value, rest, of_tangent ? mpq_class(-1) : mpq_class(1, 2));
  } else if (of_tangent) {
    s.multiply(value, one_and_square(s, y, -1), 1);
    s.multiply(value, rest, -1);
  } else {
    s.multiply(value, one_and_square(s, y, -2), 1);
  }
  return unless_longer(s, op, x, std::move(value));
}

/// sin(acos x) = √(1 - x²), cos(atan x) = 1/√(1 + x²) and the like.
std::optional<SumId> function_of_inverse(Simplifier& s, Op op, const Args& x) {
  if (op != Op::sin && op != Op::cos && op != Op::tan) return {};
  const auto a = s.lone_atom(x[0]);
  if (!a) return twice_an_inverse(s, op, x);
  const bool of_sine = s.is_function(*a, Op::asin), of_cosine = s.is_function(*a, Op::acos);
  const bool of_tangent = s.is_function(*a, Op::atan);
  if (!of_sine && !of_cosine && !of_tangent) return {};
  const SumId y = s.atom(*a).args[0], rest = one_and_square(s, y, of_tangent ? 1 : -1);
  const mpq_class half(1, 2);
  Term value{1, {}};
  if (of_tangent) {
    if (op == Op::tan) return {};
    if (op == Op::sin) s.multiply(value, y, 1);
    s.multiply(value, rest, -half);
  } else if ((op == Op::sin && of_cosine) || (op == Op::cos && of_sine)) {
    s.multiply(value, rest, half);
  } else if (op == Op::tan) {
    s.multiply(value, y, of_sine ? 1 : -1);
    s.multiply(value, rest, of_sine ? mpq_class(-half) : half);
  } else {
    return {};
  }
  return unless_longer(s, op, x, std::move(value));
}

/// exp(x + c log y) = y^c exp(x).
std::optional<SumId> exponential_without_logs(Simplifier& s, Op op, const Args& x) {
  if (op != Op::exp || s.sum(x[0]).size() < 2) return {};
  Term outside{1, {}};
  Sum rest;
  for (const Term& t : Sum(s.sum(x[0]))) {
    const bool log = t.factors.size() == 1 && t.factors[0].exponent == 1 && t.coefficient.exact() &&
                     s.is_function(t.factors[0].atom, Op::log);
    if (log)
      s.multiply(outside, s.atom(t.factors[0].atom).args[0], t.coefficient.rational());
    else
      rest.push_back(t);
  }
  if (rest.size() == s.sum(x[0]).size()) return {};
  s.multiply(outside, s.function(Op::exp, {s.intern(std::move(rest))}), 1);
  return s.product(std::move(outside));
}

/// cosh(asinh x) = √(x² + 1), tanh(acosh x) = √(x² - 1)/x and the like.
std::optional<SumId> hyperbolic_of_inverse(Simplifier& s, Op op, const Args& x) {
  const auto a = s.lone_atom(x[0]);
  if (!a || (op != Op::sinh && op != Op::cosh && op != Op::tanh)) return {};
  const bool of_sine = s.is_function(*a, Op::asinh), of_cosine = s.is_function(*a, Op::acosh);
  const bool of_tangent = s.is_function(*a, Op::atanh);
  if (!of_sine && !of_cosine && !of_tangent) return {};
  const SumId y = s.atom(*a).args[0];
  const mpq_class half(1, 2);
  const SumId rest = of_cosine ? s.minus(one_and_square(s, y, -1)) : one_and_square(s, y, of_sine ? 1 : -1);
  Term value{1, {}};
  if (of_tangent) {  // sinh = y/√(1 - y²), cosh = 1/√(1 - y²)
    if (op == Op::sinh) s.multiply(value, y, 1);
    s.multiply(value, rest, -half);
  } else if (op == Op::tanh) {
    s.multiply(value, y, of_sine ? 1 : -1);
    s.multiply(value, rest, of_sine ? mpq_class(-half) : half);
  } else {
    s.multiply(value, rest, half);
  }
  return unless_longer(s, op, x, std::move(value));
}

/// exp(c log x) = x^c; if x is a number, also for symbolic c: exp(t log 2) = 2^t.
std::optional<SumId> power_of_log(Simplifier& s, Op op, const Args& x) {
  const Sum& sum = s.sum(x[0]);
  if (op != Op::exp || sum.size() != 1 || !sum[0].coefficient.exact()) return {};
  const auto log = std::find_if(sum[0].factors.begin(), sum[0].factors.end(), [&](const Factor& f) {
    return f.exponent == 1 && s.is_function(f.atom, Op::log);
  });
  if (log == sum[0].factors.end()) return {};
  const SumId base = s.atom(log->atom).args[0];
  if (sum[0].factors.size() == 1) return s.rooted(base, sum[0].coefficient.rational());
  if (!s.constant(base)) return {};
  return s.power(base, s.intern(Sum{s.with_factor(sum[0], log->atom, -1)}));
}

/// log(8) = 3 log(2), log(1/2) = -log(2).
std::optional<SumId> log_of_number(Simplifier& s, const Number& n) {
  if (!n.exact() || n.sign() <= 0) return {};
  const mpz_class above = n.rational().get_num(), below = n.rational().get_den();
  if (above != 1 && below != 1) return {};
  const mpz_class& whole = below == 1 ? above : below;
  mpz_class root = whole;
  unsigned long power = 1;
  for (unsigned long k = mpz_sizeinbase(whole.get_mpz_t(), 2); k > 1; --k)
    if (mpz_root(root.get_mpz_t(), whole.get_mpz_t(), k) != 0) {
      power = k;
      break;
    }
  if (power == 1) root = whole;
  if (power == 1 && below == 1) return {};
  const auto exponent = static_cast<long>(power);
  return s.scaled(s.function(Op::log, {s.number(Number(mpq_class(root)))}),
                  Number(below == 1 ? exponent : -exponent));
}

/// log(a^x) = x log a for a > 0.
std::optional<SumId> log_of_symbolic_power(Simplifier& s, AtomId power) {
  const SumId base = s.atom(power).args[0], exponent = s.atom(power).args[1];
  const auto number = s.constant(base);
  const auto symbol = s.lone_atom(base);
  if (!(number && number->sign() > 0) && !(symbol && s.never_negative({*symbol, 1}))) return {};
  Term product{1, {}};
  s.multiply(product, exponent, 1);
  s.multiply(product, s.function(Op::log, {base}), 1);
  return s.product(std::move(product));
}

/// The greatest q > 0 of which all exponents are integer multiples, with the sign of the first.
mpq_class common_exponent(const Term& term) {
  mpz_class num = 0, den = 1;
  for (const Factor& f : term.factors) {
    num = gcd(num, f.exponent.get_num());
    den = lcm(den, f.exponent.get_den());
  }
  mpq_class q(num, den);
  q.canonicalize();
  return term.factors[0].exponent > 0 ? q : mpq_class(-q);
}

/// log(x^q) = q log x if x^q requires a positive x (odd or non-integer q): log(√x √y) = log(x y)/2. For even
/// q only if x > 0; otherwise log(1/x²) = -log(x²).
std::optional<SumId> log_of_power(Simplifier& s, Op op, const Args& x) {
  const Sum& sum = s.sum(x[0]);
  if (op != Op::log || sum.size() != 1) return {};
  Term inside = sum[0];
  if (inside.factors.empty()) return log_of_number(s, inside.coefficient);
  if (!inside.coefficient.is(1)) return {};
  if (inside.factors.size() == 1 && inside.factors[0].exponent == 1 &&
      s.atom(inside.factors[0].atom).kind == AtomKind::power)
    return log_of_symbolic_power(s, inside.factors[0].atom);
  mpq_class q = common_exponent(inside);
  const bool even = q.get_den() == 1 && mpz_even_p(q.get_num_mpz_t());
  const bool positive = std::all_of(inside.factors.begin(), inside.factors.end(), [&](const Factor& f) {
    return s.never_negative({f.atom, 1});
  });
  if (even && !positive) q = q > 0 ? 1 : -1;
  const bool alike = std::all_of(inside.factors.begin(), inside.factors.end(),
                                 [&](const Factor& f) { return abs(f.exponent) == abs(q); });
  if (q == 1 || !alike) return {};
  for (Factor& f : inside.factors) f.exponent /= q;
  return s.scaled(s.function(Op::log, {s.product(std::move(inside))}), Number(q));
}

std::optional<SumId> root_is_power(Simplifier& s, Op op, const Args& x) {
  if (op != Op::sqrt) return {};
  return s.rooted(x[0], mpq_class(1, 2));
}

/// |2 x² y| = 2 x² |y|.
std::optional<SumId> absolute_value(Simplifier& s, Op op, const Args& x) {
  if (op != Op::abs) return {};
  Sum terms = s.sum(x[0]);
  if (terms.size() != 1) {
    const bool positive = std::all_of(terms.begin(), terms.end(), [&](const Term& t) {
      return t.coefficient.sign() > 0 && std::all_of(t.factors.begin(), t.factors.end(),
                                                     [&](const Factor& f) { return s.never_negative(f); });
    });
    if (positive) return x[0];
    const Number c = s.content(terms);
    if (c.is(1) || c.rational().get_den() != 1) return {};  // |x - 1/2| stays
    return s.scaled(s.absolute(s.scaled(x[0], *Number::power(c, -1))), c);
  }
  Term outside{terms[0].coefficient, {}}, inside{1, {}};
  const auto others = std::count_if(terms[0].factors.begin(), terms[0].factors.end(),
                                    [&](const Factor& f) { return !s.never_negative(f); });
  for (const Factor& f : terms[0].factors) {
    const bool whole = f.exponent.get_den() == 1;
    if (s.never_negative(f)) {
      outside.factors.push_back(f);
    } else if (whole && f.exponent != 1 && others == 1) {  // |x³| = |x|³, but |x³ y| stays
      outside.factors.push_back({s.function_atom(Op::abs, {s.single(f.atom)}), f.exponent});
    } else {
      inside.factors.push_back(f);
    }
  }
  if (outside.factors.empty() && outside.coefficient.is(1)) return {};
  s.multiply(outside, inside.factors.empty() ? s.number(1) : s.function(Op::abs, {s.product(inside)}), 1);
  return s.product(outside);
}

/// sin, cos, tan of q π, reduced to 0 ≤ q ≤ 1/2 and a sign; empty if q is in that range already.
std::optional<SumId> in_first_quadrant(Simplifier& s, Op op, const mpq_class& half_turns) {
  const mpz_class whole = half_turns.get_num() / (2 * half_turns.get_den());
  mpq_class q = half_turns - 2 * mpq_class(whole);
  bool minus = false;
  if (q < 0) q += 2;
  if (q > 1) {  // shift by π: all except the tangent change their sign
    q -= 1;
    minus = op != Op::tan;
  }
  if (2 * q > 1) {  // reflection at π/2
    q = 1 - q;
    minus = minus != (op != Op::sin);
  }
  if (q == half_turns) return {};
  const SumId value = s.function(op, {s.form(Expr(q) * pi())});
  return minus ? s.minus(value) : value;
}

/// asin, acos, atan of sin, cos, tan(q π), 0 ≤ q ≤ 1/2: asin(sin(π/7)) = π/7, acos(-sin(π/7)) = 9 π/14.
std::optional<SumId> angle_of_wave(Simplifier& s, Op op, SumId x) {
  const Sum& sum = s.sum(x);
  if (sum.size() != 1 || sum[0].factors.size() != 1 || sum[0].factors[0].exponent != 1) return {};
  const Number c = sum[0].coefficient;
  const AtomId wave = sum[0].factors[0].atom;
  const bool of_sine = s.is_function(wave, Op::sin), of_cosine = s.is_function(wave, Op::cos);
  const bool of_tangent = s.is_function(wave, Op::tan);
  if ((!c.is(1) && !c.is(-1)) || (op == Op::atan ? !of_tangent : !of_sine && !of_cosine)) return {};
  const Sum& angle = s.sum(s.atom(wave).args[0]);
  if (angle.size() != 1 || s.term_of_pi(angle) != 0) return {};
  mpq_class q = angle[0].coefficient.rational();
  if (q < 0 || 2 * q > 1) return {};
  if (of_cosine) q = mpq_class(1, 2) - q;
  if (c.is(-1)) q = -q;
  if (op == Op::acos) q = mpq_class(1, 2) - q;
  return s.scaled(s.single(s.leaf_atom(pi())), Number(q));
}

/// asin, acos and atan at values of sin and tan at known angles: √2/2, (1 + √5)/4, 2 - √3, …
std::optional<SumId> angles_of_radicals(Simplifier& s, Op op, const Args& x) {
  if (op != Op::asin && op != Op::acos && op != Op::atan) return {};
  if (const auto angle = angle_of_wave(s, op, x[0])) return angle;
  if (s.traits(x[0]).level >= 0) return {};
  static const mpq_class angles[] = {{1, 12}, {1, 10}, {1, 8}, {1, 6}, {1, 5}, {1, 4},
                                     {3, 10}, {1, 3},  {3, 8}, {2, 5}, {5, 12}};
  for (const mpq_class& q : angles) {
    const SumId known = s.form(*trigonometric_value(op == Op::atan ? Op::tan : Op::sin, q));
    const bool minus = x[0] == s.minus(known);
    if (!minus && x[0] != known) continue;
    const mpq_class angle = minus ? mpq_class(-q) : q;
    return s.form(Expr(op == Op::acos ? mpq_class(mpq_class(1, 2) - angle) : angle) * pi());
  }
  return {};
}

/// sin, cos and tan at known multiples of π; sin(x + π) = -sin x, cos(x + π/2) = -sin x.
std::optional<SumId> multiples_of_pi(Simplifier& s, Op op, const Args& x) {
  if (op != Op::sin && op != Op::cos && op != Op::tan) return {};
  Sum sum = s.sum(x[0]);
  const auto place = s.term_of_pi(sum);
  if (!place) return {};
  const mpq_class turns = sum[*place].coefficient.rational();  // in half turns
  if (sum.size() == 1) {
    const auto value = trigonometric_value(op, turns);
    return value ? std::optional(s.form(*value)) : in_first_quadrant(s, op, turns);
  }
  const mpq_class quarters = 2 * turns;
  if (quarters.get_den() != 1) return {};
  const unsigned long k = mpz_fdiv_ui(quarters.get_num_mpz_t(), 4);
  sum.erase(sum.begin() + static_cast<std::ptrdiff_t>(*place));
  const SumId rest = s.intern(std::move(sum));
  if (op == Op::tan) return k % 2 == 0 ? std::optional(s.function(Op::tan, {rest})) : std::nullopt;
  const bool sine = (op == Op::sin) == (k % 2 == 0);
  const bool minus = op == Op::sin ? k >= 2 : k == 1 || k == 2;
  const SumId value = s.function(sine ? Op::sin : Op::cos, {rest});
  return minus ? s.minus(value) : value;
}

std::optional<SumId> equal_branches(Simplifier& s, Op op, const Args& x) {
  if (op == Op::ifelse && x[1] == x[2]) return x[1];
  if ((op == Op::min || op == Op::max) && x[0] == x[1]) return x[0];
  if (op == Op::ifelse)
    if (const auto c = s.constant(x[0])) return x[c->sign() != 0 ? 1 : 2];
  return {};
}

constexpr FunctionRule functions[] = {
    {"sqrt(x) = x^(1/2)", root_is_power},
    {"f(-x) = -f(x) or f(x)", fold_parity},
    {"log(exp x) = x and the like", cancel_inverse},
    {"sin(acos x) = √(1 - x²), cos(2 acos x) = 2 x² - 1", function_of_inverse},
    {"cosh(asinh x) = √(x² + 1)", hyperbolic_of_inverse},
    {"exp(c log x) = x^c, exp(x log 2) = 2^x", power_of_log},
    {"exp(x + log y) = y exp(x)", exponential_without_logs},
    {"log(x^3) = 3 log x, log(8) = 3 log(2), log(2^x) = x log(2)", log_of_power},
    {"|2 x² y| = 2 x² |y|, |x² + 1| = x² + 1", absolute_value},
    {"sin(π) = 0, sin(x + π) = -sin x", multiples_of_pi},
    {"asin(√3/2) = π/3, atan(2 - √3) = π/12", angles_of_radicals},
    {"ifelse(c, p, p) = p", equal_branches},
};

constexpr SquareRule squares[] = {
    {"sin² + cos² = 1", Op::sin, Op::cos, 1, 1},
    {"cosh² - sinh² = 1", Op::cosh, Op::sinh, 1, -1},
};

}  // namespace

std::span<const FunctionRule> function_rules() { return functions; }
std::span<const SquareRule> square_rules() { return squares; }

}  // namespace pendula
