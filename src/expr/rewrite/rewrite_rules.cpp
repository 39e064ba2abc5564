// The rules of simplify. All of them hold over the reals wherever the left side is defined.
#include <cmath>

#include "base/interrupt.hpp"
#include "expr/graph/angle.hpp"
#include "expr/graph/operation.hpp"
#include "expr/polynomial/rational_form.hpp"
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

/// outer(inner(x)) = x.
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
  return s.product(std::move(value));
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
  return s.product(std::move(value));
}

/// exp(c log x) = x^c.
std::optional<SumId> power_of_log(Simplifier& s, Op op, const Args& x) {
  const Sum& sum = s.sum(x[0]);
  if (op != Op::exp || sum.size() != 1 || sum[0].factors.size() != 1 || !sum[0].coefficient.exact())
    return {};
  const Factor& f = sum[0].factors[0];
  if (f.exponent != 1 || !s.is_function(f.atom, Op::log)) return {};
  return s.rooted(s.atom(f.atom).args[0], sum[0].coefficient.rational());
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

/// log(x^q) = q log x where x must be positive for x^q to be: q odd or not whole.
std::optional<SumId> log_of_power(Simplifier& s, Op op, const Args& x) {
  const Sum& sum = s.sum(x[0]);
  if (op == Op::log && sum.size() == 1 && sum[0].factors.empty()) return log_of_number(s, sum[0].coefficient);
  if (op != Op::log || sum.size() != 1 || sum[0].factors.size() != 1 || !sum[0].coefficient.is(1)) return {};
  const Factor f = sum[0].factors[0];
  const bool even = f.exponent.get_den() == 1 && mpz_even_p(f.exponent.get_num_mpz_t());
  if (even || f.exponent == 1) return {};
  return s.scaled(s.function(Op::log, {s.single(f.atom)}), Number(f.exponent));
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
    if (c.is(1)) return {};
    return s.scaled(s.absolute(s.scaled(x[0], *Number::power(c, -1))), c);
  }
  Term outside{terms[0].coefficient, {}}, inside{1, {}};
  for (const Factor& f : terms[0].factors) {
    const bool whole = f.exponent.get_den() == 1;
    if (s.never_negative(f)) {
      outside.factors.push_back(f);
    } else if (whole && f.exponent != 1) {
      outside.factors.push_back({s.function_atom(Op::abs, {s.single(f.atom)}), f.exponent});
    } else {
      inside.factors.push_back(f);
    }
  }
  if (outside.factors.empty() && outside.coefficient.is(1)) return {};
  s.multiply(outside, inside.factors.empty() ? s.number(1) : s.function(Op::abs, {s.product(inside)}), 1);
  return s.product(outside);
}

/// The multiple of π among the terms of a sum, in half turns.
std::optional<std::size_t> term_of_pi(Simplifier& s, const Sum& sum) {
  const std::vector<Factor> only_pi{{s.leaf_atom(pi()), 1}};
  for (std::size_t k = 0; k < sum.size(); ++k)
    if (sum[k].factors == only_pi && sum[k].coefficient.exact()) return k;
  return {};
}

/// sin, cos, tan of q π with 0 ≤ q ≤ 1/2 and a sign; nothing where q is there already.
std::optional<SumId> in_first_quadrant(Simplifier& s, Op op, const mpq_class& half_turns) {
  const mpz_class whole = half_turns.get_num() / (2 * half_turns.get_den());
  mpq_class q = half_turns - 2 * mpq_class(whole);
  bool minus = false;
  if (q < 0) q += 2;
  if (q > 1) {  // by π: all but the tangent change their sign
    q -= 1;
    minus = op != Op::tan;
  }
  if (2 * q > 1) {  // the reflection at π/2
    q = 1 - q;
    minus = minus != (op != Op::sin);
  }
  if (q == half_turns) return {};
  const SumId value = s.function(op, {s.form(Expr(q) * pi())});
  return minus ? s.minus(value) : value;
}

/// asin, acos and atan at √2/2, √3/2, √3/3 and √3.
std::optional<SumId> angles_of_radicals(Simplifier& s, Op op, const Args& x) {
  if (op != Op::asin && op != Op::acos && op != Op::atan) return {};
  if (s.sum(x[0]).size() != 1 || s.sum(x[0])[0].factors.size() != 1) return {};
  for (const mpq_class& q : {mpq_class(1, 6), mpq_class(1, 4), mpq_class(1, 3)}) {
    const auto value = trigonometric_value(op == Op::atan ? Op::tan : Op::sin, q);
    const SumId known = s.form(*value);
    const bool minus = x[0] == s.minus(known);
    if (!minus && x[0] != known) continue;
    const mpq_class angle = minus ? mpq_class(-q) : q;
    return s.form(Expr(op == Op::acos ? mpq_class(mpq_class(1, 2) - angle) : angle) * pi());
  }
  return {};
}

/// sin and cos at multiples of π/6 and π/4, tan at multiples of π; sin(x + π) = -sin x, cos(x + π/2) = -sin x.
std::optional<SumId> multiples_of_pi(Simplifier& s, Op op, const Args& x) {
  if (op != Op::sin && op != Op::cos && op != Op::tan) return {};
  Sum sum = s.sum(x[0]);
  const auto place = term_of_pi(s, sum);
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
    {"exp(c log x) = x^c", power_of_log},
    {"log(x^3) = 3 log x, log(8) = 3 log(2)", log_of_power},
    {"|2 x² y| = 2 x² |y|, |x² + 1| = x² + 1", absolute_value},
    {"sin(π) = 0, sin(x + π) = -sin x", multiples_of_pi},
    {"asin(√3/2) = π/3", angles_of_radicals},
    {"ifelse(c, p, p) = p", equal_branches},
};

// ── products ───────────────────────────────────────────────────────────────────────────────────────────────

/// exp(a) exp(b) = exp(a + b).
bool merge_exponentials(Simplifier& s, Term& term) {
  Sum exponent;
  int count = 0;
  bool other_power = false;
  for (const Factor& f : term.factors) {
    if (!s.is_function(f.atom, Op::exp)) continue;
    ++count;
    other_power = other_power || f.exponent != 1;
    const SumId scaled = s.scaled(s.atom(f.atom).args[0], Number(f.exponent));
    exponent.insert(exponent.end(), s.sum(scaled).begin(), s.sum(scaled).end());
  }
  if (count == 0 || (count == 1 && !other_power)) return false;
  std::erase_if(term.factors, [&](const Factor& f) { return s.is_function(f.atom, Op::exp); });
  s.multiply(term, s.function(Op::exp, {s.intern(std::move(exponent))}), 1);
  return true;
}

/// x^a x^b = x^(a + b).
bool merge_powers(Simplifier& s, Term& term) {
  for (std::size_t i = 0; i < term.factors.size(); ++i) {
    const AtomId a = term.factors[i].atom;
    if (s.atom(a).kind != AtomKind::power) continue;
    const SumId base = s.atom(a).args[0];
    Sum exponent;
    std::size_t count = 0;
    for (const Factor& f : term.factors) {
      if (s.atom(f.atom).kind != AtomKind::power || s.atom(f.atom).args[0] != base) continue;
      if (f.exponent.get_den() != 1) return false;  // (x^y)^(1/2) is not x^(y/2) where x is negative
      ++count;
      const SumId scaled = s.scaled(s.atom(f.atom).args[1], Number(f.exponent));
      exponent.insert(exponent.end(), s.sum(scaled).begin(), s.sum(scaled).end());
    }
    const bool power = count == 1 && term.factors[i].exponent > 1;  // (x^y)² = x^(2 y)
    if (count < 2 && !power) continue;
    std::erase_if(term.factors, [&](const Factor& f) {
      return s.atom(f.atom).kind == AtomKind::power && s.atom(f.atom).args[0] == base;
    });
    s.multiply(term, s.power(base, s.intern(std::move(exponent))), 1);
    return true;
  }
  return false;
}

/// |x|² = x².
bool square_absolutes(Simplifier& s, Term& term) {
  for (auto it = term.factors.begin(); it != term.factors.end(); ++it) {
    const bool even = it->exponent.get_den() == 1 && mpz_even_p(it->exponent.get_num_mpz_t());
    if (!even || !s.is_function(it->atom, Op::abs)) continue;
    const Factor f = *it;
    term.factors.erase(it);
    s.multiply(term, s.atom(f.atom).args[0], f.exponent);
    return true;
  }
  return false;
}

/// |x| |y| = |x y|, |x|/|y| = |x/y|.
bool merge_absolutes(Simplifier& s, Term& term) {
  Term inside{1, {}};
  int count = 0;
  for (const Factor& f : term.factors) {
    if (!s.is_function(f.atom, Op::abs) || abs(f.exponent) != 1) continue;
    s.multiply(inside, s.atom(f.atom).args[0], f.exponent);
    ++count;
  }
  if (count < 2) return false;
  std::erase_if(term.factors,
                [&](const Factor& f) { return s.is_function(f.atom, Op::abs) && abs(f.exponent) == 1; });
  s.multiply(term, s.single(s.function_atom(Op::abs, {s.product(std::move(inside))})), 1);
  return true;
}

/// The place of op(argument) among the factors.
std::vector<Factor>::iterator find_function(Simplifier& s, Term& term, Op op, SumId argument) {
  return std::find_if(term.factors.begin(), term.factors.end(), [&](const Factor& f) {
    return s.is_function(f.atom, op) && s.atom(f.atom).args[0] == argument;
  });
}

/// tan x cos x = sin x, and sin x/cos x = tan x; likewise for the hyperbolic functions.
bool tangents(Simplifier& s, Term& term) {
  constexpr Op families[][3] = {{Op::tan, Op::sin, Op::cos}, {Op::tanh, Op::sinh, Op::cosh}};
  for (const auto& [tan, sin, cos] : families) {
    for (auto it = term.factors.begin(); it != term.factors.end(); ++it) {
      const SumId x = s.atom(it->atom).args.empty() ? 0 : s.atom(it->atom).args[0];
      const auto si = find_function(s, term, sin, x), co = find_function(s, term, cos, x);
      const auto none = term.factors.end();
      if (s.is_function(it->atom, tan) && (si != none || co != none)) {
        const mpq_class n = it->exponent;
        term.factors.erase(it);
        term.factors.push_back({s.function_atom(sin, {x}), n});
        term.factors.push_back({s.function_atom(cos, {x}), -n});
        return true;
      }
      if (it == si && co != none && si->exponent == -co->exponent && si->exponent.get_den() == 1) {
        const mpq_class n = si->exponent;
        const AtomId both[] = {si->atom, co->atom};
        std::erase_if(term.factors, [&](const Factor& f) { return f.atom == both[0] || f.atom == both[1]; });
        term.factors.push_back({s.function_atom(tan, {x}), n});
        return true;
      }
    }
  }
  return false;
}

/// (x² - 1)/(x - 1) = x + 1.
bool divide_sums(Simplifier& s, Term& term) {
  std::vector<std::size_t> above, below;  // factors that are whole powers of sums
  for (std::size_t i = 0; i < term.factors.size(); ++i) {
    const Factor& f = term.factors[i];
    if (f.exponent.get_den() != 1 || s.atom(f.atom).kind != AtomKind::sum) continue;
    (f.exponent > 0 ? above : below).push_back(i);
  }
  for (const std::size_t i : above)
    for (const std::size_t j : below) {
      poll_interrupt();
      const SumId sa = s.atom(term.factors[i].atom).args[0], sb = s.atom(term.factors[j].atom).args[0];
      auto quotient = s.exact_quotient(sa, sb);
      const int sign = quotient ? 1 : -1;
      if (!quotient) quotient = s.exact_quotient(sb, sa);
      if (!quotient) continue;
      term.factors[i].exponent -= 1;
      term.factors[j].exponent += 1;
      s.multiply(term, *quotient, sign);
      return true;
    }
  return false;
}

/// Whether two sums may have a common factor that is worth looking for.
bool may_share_factor(Simplifier& s, SumId a, SumId b) {
  constexpr std::size_t most = 30;  // terms
  if (s.sum(a).size() > most || s.sum(b).size() > most) return false;
  std::vector<AtomId> of_a, of_b;
  for (const auto& [sum, atoms] : {std::pair{a, &of_a}, std::pair{b, &of_b}})
    for (const Term& t : s.sum(sum))
      for (const Factor& f : t.factors) {
        if (f.exponent < 0 || f.exponent.get_den() != 1) return false;
        atoms->push_back(f.atom);
      }
  return std::any_of(of_a.begin(), of_a.end(),
                     [&](AtomId x) { return std::find(of_b.begin(), of_b.end(), x) != of_b.end(); });
}

/// (x³ - 1)/(x² - 1) = (x² + x + 1)/(x + 1).
bool cancel_common_factors(Simplifier& s, Term& term) {
  for (std::size_t i = 0; i < term.factors.size(); ++i)
    for (std::size_t j = 0; j < term.factors.size(); ++j) {
      const Factor above = term.factors[i], below = term.factors[j];
      if (above.exponent < 1 || below.exponent > -1) continue;
      if (above.exponent.get_den() != 1 || below.exponent.get_den() != 1) continue;
      if (s.atom(above.atom).kind != AtomKind::sum || s.atom(below.atom).kind != AtomKind::sum) continue;
      const SumId sa = s.atom(above.atom).args[0], sb = s.atom(below.atom).args[0];
      if (!may_share_factor(s, sa, sb)) continue;
      const auto common = common_divisor(s, sa, sb);
      const auto qa = common ? s.exact_quotient(sa, *common) : std::nullopt;
      const auto qb = common ? s.exact_quotient(sb, *common) : std::nullopt;
      if (!qa || !qb) continue;
      term.factors[i].exponent -= 1;
      term.factors[j].exponent += 1;
      s.multiply(term, *qa, 1);
      s.multiply(term, *qb, -1);
      return true;
    }
  return false;
}

/// 1/(1/a + 1/b) = a b/(a + b).
bool clear_denominators(Simplifier& s, Term& term) {
  for (std::size_t i = 0; i < term.factors.size(); ++i) {
    const Factor f = term.factors[i];
    if (f.exponent >= 0 || f.exponent.get_den() != 1 || s.atom(f.atom).kind != AtomKind::sum) continue;
    Sum inside = s.sum(s.atom(f.atom).args[0]);
    std::vector<Factor> below;  // the highest powers in denominators, as positive exponents
    for (const Term& t : inside)
      for (const Factor& g : t.factors) {
        if (g.exponent >= 0 || g.exponent.get_den() != 1) continue;
        const auto known =
            std::find_if(below.begin(), below.end(), [&](const Factor& b) { return b.atom == g.atom; });
        if (known == below.end())
          below.push_back({g.atom, -g.exponent});
        else if (known->exponent < -g.exponent)
          known->exponent = -g.exponent;
      }
    if (below.empty()) continue;
    for (Term& t : inside) {
      t.factors.insert(t.factors.end(), below.begin(), below.end());
      s.collect(t);
    }
    term.factors.erase(term.factors.begin() + static_cast<std::ptrdiff_t>(i));
    for (const Factor& b : below) term.factors.push_back({b.atom, -b.exponent * f.exponent});
    s.multiply(term, s.intern(std::move(inside)), f.exponent);
    return true;
  }
  return false;
}

/// The largest k with k² | n, by trial division; n itself is left as n/k².
mpz_class square_part(mpz_class& n) {
  constexpr unsigned long largest = 1000;
  mpz_class root = 1;
  for (unsigned long p = 2; p <= largest && p * p <= n; ++p)
    while (mpz_divisible_ui_p(n.get_mpz_t(), p * p)) {
      n /= p * p;
      root *= p;
    }
  return root;
}

/// √2 √6 = 2 √3, 1/√2 = √2/2, √8 = 2 √2: one root of a whole number without square factors.
bool collect_square_roots(Simplifier& s, Term& term) {
  mpz_class inside = 1, below = 1;
  std::vector<AtomId> roots;
  bool minus = false;
  for (const Factor& f : term.factors) {
    if (abs(f.exponent) != mpq_class(1, 2) || s.atom(f.atom).kind != AtomKind::sum) continue;
    const auto c = s.constant(s.atom(f.atom).args[0]);
    if (!c || !c->exact() || c->sign() <= 0 || c->rational().get_den() != 1) continue;
    inside *= c->rational().get_num();
    if (f.exponent < 0) below *= c->rational().get_num();
    minus = minus || f.exponent < 0;
    roots.push_back(f.atom);
  }
  if (roots.empty() || !term.coefficient.exact()) return false;
  const mpz_class outside = square_part(inside);
  if (roots.size() == 1 && outside == 1 && !minus) return false;
  std::erase_if(term.factors, [&](const Factor& f) {
    return std::find(roots.begin(), roots.end(), f.atom) != roots.end();
  });
  mpq_class c(outside, below);
  c.canonicalize();
  term.coefficient = term.coefficient * Number(c);
  if (inside != 1) term.factors.push_back({s.sum_atom(s.number(Number(mpq_class(inside)))), mpq_class(1, 2)});
  return true;
}

constexpr ProductRule products[] = {
    {"exp a exp b = exp(a + b)", merge_exponentials},
    {"x^a x^b = x^(a + b)", merge_powers},
    {"|x|² = x²", square_absolutes},
    {"|x| |y| = |x y|", merge_absolutes},
    {"√2 √6 = 2 √3", collect_square_roots},
    {"tan x cos x = sin x", tangents},
    {"(x² - 1)/(x - 1) = x + 1", divide_sums},
    {"(x³ - 1)/(x² - 1) = (x² + x + 1)/(x + 1)", cancel_common_factors},
    {"1/(1/a + 1/b) = a b/(a + b)", clear_denominators},
};

constexpr SquareRule squares[] = {
    {"sin² + cos² = 1", Op::sin, Op::cos, 1, 1},
    {"cosh² - sinh² = 1", Op::cosh, Op::sinh, 1, -1},
};

}  // namespace

std::span<const FunctionRule> function_rules() { return functions; }
std::span<const ProductRule> product_rules() { return products; }
std::span<const SquareRule> square_rules() { return squares; }

}  // namespace pendula
