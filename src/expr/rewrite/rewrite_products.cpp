// The rules of simplify for products. All hold over the reals wherever the left side is defined.
#include "base/interrupt.hpp"
#include "expr/graph/fold.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/rewrite/rewrite_forms.hpp"

namespace pendula {
namespace {

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

/// |x| |y| = |x y|, |x|³/|y| = |x³/y|.
bool merge_absolutes(Simplifier& s, Term& term) {
  const auto merges = [&](const Factor& f) {
    return s.is_function(f.atom, Op::abs) && f.exponent.get_den() == 1;
  };
  if (std::count_if(term.factors.begin(), term.factors.end(), merges) < 2) return false;
  Term inside{1, {}};
  for (const Factor& f : term.factors)
    if (merges(f)) s.multiply(inside, s.atom(f.atom).args[0], f.exponent);
  std::erase_if(term.factors, merges);
  s.multiply(term, s.single(s.function_atom(Op::abs, {s.product(std::move(inside))})), 1);
  return true;
}

/// The position of op(argument) among the factors.
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
  std::vector<std::size_t> above, below;  // factors that are integer powers of sums
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

/// Can two sums have a common factor worth searching for?
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

/// The highest powers in the denominators of the terms of a sum, as positive exponents.
std::vector<Factor> denominators(const Sum& terms) {
  std::vector<Factor> below;
  for (const Term& t : terms)
    for (const Factor& g : t.factors) {
      if (g.exponent >= 0 || g.exponent.get_den() != 1) continue;
      const auto known =
          std::find_if(below.begin(), below.end(), [&](const Factor& b) { return b.atom == g.atom; });
      if (known == below.end())
        below.push_back({g.atom, -g.exponent});
      else if (known->exponent < -g.exponent)
        known->exponent = -g.exponent;
    }
  return below;
}

/// 1/(1/a + 1/b) = a b/(a + b), a b (1/a - 1/b) = b - a, unless that is longer.
bool clear_denominators(Simplifier& s, Term& term) {
  for (std::size_t i = 0; i < term.factors.size(); ++i) {
    const Factor f = term.factors[i];
    if (f.exponent.get_den() != 1 || s.atom(f.atom).kind != AtomKind::sum) continue;
    Sum inside = s.sum(s.atom(f.atom).args[0]);
    const std::vector<Factor> below = denominators(inside);
    const bool outside = std::all_of(below.begin(), below.end(), [&](const Factor& b) {
      return std::any_of(term.factors.begin(), term.factors.end(), [&](const Factor& g) {
        return g.atom == b.atom && g.exponent >= b.exponent * f.exponent;
      });
    });
    if (below.empty() || (f.exponent > 0 && !outside)) continue;
    for (Term& t : inside) {
      t.factors.insert(t.factors.end(), below.begin(), below.end());
      s.collect(t);
    }
    Term cleared = term;
    cleared.factors.erase(cleared.factors.begin() + static_cast<std::ptrdiff_t>(i));
    for (const Factor& b : below) cleared.factors.push_back({b.atom, -b.exponent * f.exponent});
    s.multiply(cleared, s.intern(std::move(inside)), f.exponent);
    s.collect(cleared);
    if (s.traits_of(cleared).tokens > s.traits_of(term).tokens) continue;
    term = std::move(cleared);
    return true;
  }
  return false;
}

/// (1 + √3)/(1 - √3) = -2 - √3: multiplies a sum of two roots in the denominator by its conjugate, unless
/// that is longer.
bool rationalise(Simplifier& s, Term& term) {
  const auto numeric = [&](const Factor& f, int exponent) {
    return f.exponent == exponent && s.atom(f.atom).kind == AtomKind::sum &&
           s.atom(f.atom).traits.level < 0 && s.sum(s.atom(f.atom).args[0]).size() == 2;
  };
  for (const Factor& f : term.factors) {
    if (!numeric(f, -1)) continue;
    Sum conjugate = s.sum(s.atom(f.atom).args[0]);
    conjugate[1].coefficient = -conjugate[1].coefficient;
    const AtomId other = s.sum_atom(s.intern(std::move(conjugate)));
    Term product{1, {{f.atom, 1}, {other, 1}}}, above{1, {{other, 1}}};
    s.collect(product);
    auto below = s.multiplied_out(product, 4);
    const auto number = below ? s.constant(s.intern(std::move(*below))) : std::nullopt;
    if (!number || !number->exact() || number->sign() == 0) continue;
    Term rest{term.coefficient * *Number::power(*number, -1), {}};
    for (const Factor& g : term.factors)
      if (g.atom != f.atom) (numeric(g, 1) ? above : rest).factors.push_back(g);
    s.collect(above);
    auto numerator = s.multiplied_out(above, 8);
    if (!numerator) continue;
    s.multiply(rest, s.intern(std::move(*numerator)), 1);
    s.collect(rest);
    if (s.traits_of(rest).tokens > s.traits_of(term).tokens) continue;
    term = std::move(rest);
    return true;
  }
  return false;
}

/// The largest k with k² | n, by trial division; n is replaced by n/k².
mpz_class square_part(mpz_class& n) {
  mpz_class root = 1;
  for (unsigned long p = 2; p <= largest_trial_divisor && p * p <= n; ++p)
    while (mpz_divisible_ui_p(n.get_mpz_t(), p * p)) {
      n /= p * p;
      root *= p;
    }
  return root;
}

/// √2 √6 = 2 √3, 1/√2 = √2/2, √8 = 2 √2: combines roots into one root of a squarefree integer.
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

/// √(2 + √2) √(2 - √2) = √2: combines nested roots of numbers into one root.
bool merge_nested_roots(Simplifier& s, Term& term) {
  const auto nested = [&](const Factor& f) {
    return abs(f.exponent) == mpq_class(1, 2) && s.atom(f.atom).kind == AtomKind::sum &&
           s.atom(f.atom).traits.level < 0 && s.sum(s.atom(f.atom).args[0]).size() == 2;
  };
  for (std::size_t i = 0; i < term.factors.size(); ++i)
    for (std::size_t j = i + 1; j < term.factors.size(); ++j) {
      const Factor f = term.factors[i], g = term.factors[j];
      if (!nested(f) || !nested(g)) continue;
      Term inside{1, {{f.atom, 1}, {g.atom, 1}}};
      s.collect(inside);
      auto out = s.multiplied_out(inside, 4);
      if (!out) continue;
      const SumId whole = s.intern(std::move(*out));
      if (s.sum(whole).size() > 2) continue;  // √(2 + √2) √(2 + √3)
      term.factors.erase(term.factors.begin() + static_cast<std::ptrdiff_t>(j));
      term.factors.erase(term.factors.begin() + static_cast<std::ptrdiff_t>(i));
      s.multiply(term, whole, mpq_class(1, 2));
      for (const Factor& below : {f, g})
        if (below.exponent < 0) s.multiply(term, s.atom(below.atom).args[0], -1);
      return true;
    }
  return false;
}

/// |x| sign(x) = x.
bool absorb_signs(Simplifier& s, Term& term) {
  for (const Factor& sign : term.factors) {
    if (!s.is_function(sign.atom, Op::sign) || sign.exponent != 1) continue;
    const SumId x = s.atom(sign.atom).args[0], size = s.absolute(x);
    const auto it = std::find_if(term.factors.begin(), term.factors.end(), [&](const Factor& f) {
      return f.exponent == 1 && s.single(f.atom) == size;
    });
    if (it == term.factors.end()) continue;
    const AtomId both[] = {sign.atom, it->atom};
    std::erase_if(term.factors, [&](const Factor& f) { return f.atom == both[0] || f.atom == both[1]; });
    s.multiply(term, x, 1);
    return true;
  }
  return false;
}

constexpr ProductRule products[] = {
    {"exp a exp b = exp(a + b)", merge_exponentials},
    {"x^a x^b = x^(a + b)", merge_powers},
    {"|x|² = x²", square_absolutes},
    {"|x| |y| = |x y|", merge_absolutes},
    {"|x| sign(x) = x", absorb_signs},
    {"√2 √6 = 2 √3", collect_square_roots},
    {"√(2 + √2) √(2 - √2) = √2", merge_nested_roots},
    {"tan x cos x = sin x", tangents},
    {"(x² - 1)/(x - 1) = x + 1", divide_sums},
    {"(x³ - 1)/(x² - 1) = (x² + x + 1)/(x + 1)", cancel_common_factors},
    {"1/(1/a + 1/b) = a b/(a + b)", clear_denominators},
    {"(1 + √3)/(1 - √3) = -2 - √3", rationalise},
};

}  // namespace

std::span<const ProductRule> product_rules() { return products; }

}  // namespace pendula
