#include "expr/rewrite/rewrite.hpp"

#include <optional>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/lru_cache.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/assumption.hpp"
#include "expr/rewrite/rewrite_forms.hpp"
#include "expr/rewrite/rewrite_patterns.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula {
namespace {

// (a + b + c + d + e)³⁰, 46000 terms and 10⁶ products, takes 7 s.
constexpr std::size_t most_expanded_terms = 100'000;
constexpr double most_expanded_products = 2e6;
// Caps against rules that undo each other.
constexpr std::size_t most_rounds = 12;
constexpr int most_product_rules = 40;

/// The d-th root of a positive rational, if it is rational.
std::optional<mpq_class> exact_root(const mpq_class& q, unsigned long d) {
  mpq_class root;
  const bool exact = mpz_root(root.get_num_mpz_t(), q.get_num_mpz_t(), d) != 0 &&
                     mpz_root(root.get_den_mpz_t(), q.get_den_mpz_t(), d) != 0;
  return exact ? std::optional(root) : std::nullopt;
}

}  // namespace

// ── expand ─────────────────────────────────────────────────────────────────────────────────────────────────

SumId Expander::rewritten_product(Term term) {
  Sum result{Term{term.coefficient, {}}};
  std::vector<Factor> sums;
  for (const Factor& f : term.factors) {
    const bool out = multiplies_out(f);
    (out ? sums : result[0].factors).push_back(f);
  }
  for (const Factor& f : sums) {
    const Sum by = sum(atom(f.atom).args[0]);
    if (f.exponent > limit_) result.resize(limit_ + 1);  // the n-th power of a sum has at least n + 1 terms
    for (mpz_class k = 0; k < f.exponent.get_num(); ++k) {
      poll_interrupt();
      made_ += static_cast<double>(result.size() * by.size());
      if (result.size() > limit_ || made_ > most_expanded_products)
        throw Error(text("more than ", limit_,
                         " terms; expand only the parts that need it, or leave the "
                         "expression factored: derivatives, fn and integrate do not need it expanded"));
      Sum product;
      product.reserve(result.size() * by.size());
      for (const Term& a : result)
        for (const Term& b : by) product.push_back(times(a, b));
      result = sum(intern(std::move(product)));
    }
  }
  if (sums.empty()) return finished_product(std::move(result[0]));
  Sum whole;
  for (Term& t : result) {
    if (!multiplies_out(t)) {
      whole.push_back(std::move(t));
      continue;
    }
    const SumId again = rewritten_product(std::move(t));  // for example x + 1 from √(x + 1) √(x + 1)
    whole.insert(whole.end(), sum(again).begin(), sum(again).end());
  }
  return intern(std::move(whole));
}

Expr expand(Expr e) {
  Expander forms(most_expanded_terms);
  return forms.build(forms.form(e));
}

// ── simplify ───────────────────────────────────────────────────────────────────────────────────────────────

std::optional<Number> Simplifier::constant(SumId s) const {
  if (sum(s).empty()) return Number(0);
  if (sum(s).size() == 1 && sum(s)[0].factors.empty()) return sum(s)[0].coefficient;
  return {};
}

std::optional<AtomId> Simplifier::lone_atom(SumId s) const {
  const Sum& terms = sum(s);
  if (terms.size() != 1 || !terms[0].coefficient.is(1) || terms[0].factors.size() != 1) return {};
  return terms[0].factors[0].exponent == 1 ? std::optional(terms[0].factors[0].atom) : std::nullopt;
}

bool Simplifier::leads_negative(SumId s) const {
  return !sum(s).empty() && sum(s)[order_of(s)[0]].coefficient.sign() < 0;
}

bool Simplifier::never_negative(const Factor& f) const {
  const bool whole = f.exponent.get_den() == 1;
  const Atom& a = atom(f.atom);
  if (a.kind == AtomKind::leaf && is_assumed_positive(a.node)) return true;
  return !whole || mpz_even_p(f.exponent.get_num_mpz_t()) || is_function(f.atom, Op::abs) ||
         is_function(f.atom, Op::exp) || is_function(f.atom, Op::cosh);
}

SumId Simplifier::rooted(SumId s, const mpq_class& exponent) {
  Term term{1, {}};
  multiply(term, s, exponent);
  return product(std::move(term));
}

SumId Simplifier::function(Op op, std::vector<SumId> args) {
  std::vector<Expr> values;
  for (SumId a : args)
    if (const auto c = constant(a)) values.push_back(c->expr());
  if (values.size() == args.size()) {
    values.resize(3);
    const Expr value = make(op, values[0], values[1], values[2]);
    if (value.is_constant()) return number(Number::of(value));
  }
  for (const FunctionRule& rule : function_rules())
    if (const auto simpler = rule.apply(*this, op, args)) return *simpler;
  return single(function_atom(op, std::move(args)));
}

/// b^(x log c/log b) = c^x.
std::optional<SumId> Simplifier::exchanged_base(SumId base, SumId exponent) {
  const Sum& terms = sum(exponent);
  if (terms.size() != 1) return {};
  Term rest = terms[0];
  const SumId log_of_base = function(Op::log, {base});
  const auto below = std::find_if(rest.factors.begin(), rest.factors.end(), [&](const Factor& f) {
    return f.exponent == -1 && single(f.atom) == log_of_base;
  });
  const auto above = std::find_if(rest.factors.begin(), rest.factors.end(), [&](const Factor& f) {
    return f.exponent == 1 && is_function(f.atom, Op::log);
  });
  if (below == rest.factors.end() || above == rest.factors.end()) return {};
  const AtomId logs[] = {below->atom, above->atom};
  std::erase_if(rest.factors, [&](const Factor& f) { return f.atom == logs[0] || f.atom == logs[1]; });
  return power(atom(logs[1]).args[0], intern(Sum{std::move(rest)}));
}

SumId Simplifier::power(SumId base, SumId exponent) {
  if (const auto q = constant(exponent); q && q->exact() && !sum(base).empty())
    return rooted(base, q->rational());
  if (const auto b = constant(base); b && b->is(1)) return number(1);
  if (const auto other = exchanged_base(base, exponent)) return *other;
  // (p^a)^b = p^(a b) for p > 0
  if (const auto a = lone_atom(base); a && atom(*a).kind == AtomKind::power) {
    const SumId inner = atom(*a).args[0], above = atom(*a).args[1];
    const auto p = lone_atom(inner);
    if (p && never_negative({*p, 1})) {
      Term product_of_exponents{1, {}};
      multiply(product_of_exponents, above, 1);
      multiply(product_of_exponents, exponent, 1);
      return power(inner, product(std::move(product_of_exponents)));
    }
  }
  return single(power_atom(base, exponent));
}

/// (2x² y - 4x)  ->  2x, (x y - 2): numbers, common powers, and the sign of the first term.
Term Simplifier::take_common(Sum& terms) const {
  Term common{take_content(terms), {}};
  for (const Factor& f : terms[0].factors) {
    Factor least = f;
    for (const Term& t : terms) {
      const auto it =
          std::find_if(t.factors.begin(), t.factors.end(), [&](const Factor& g) { return g.atom == f.atom; });
      const bool same_sign = it != t.factors.end() && (it->exponent > 0) == (f.exponent > 0);
      if (!same_sign) {
        least.exponent = 0;
        break;
      }
      if (abs(it->exponent) < abs(least.exponent)) least.exponent = it->exponent;
    }
    if (least.exponent != 0) common.factors.push_back(least);
  }
  for (Term& t : terms) {
    for (const Factor& f : common.factors) t.factors.push_back({f.atom, -f.exponent});
    collect(t);
  }
  std::size_t first = 0;
  std::vector<TermKey> keys;
  for (const Term& t : terms) keys.push_back(key(t));
  for (std::size_t i = 1; i < terms.size(); ++i)
    if (term_before(terms[i], keys[i], terms[first], keys[first])) first = i;
  if (terms[first].coefficient.sign() < 0) {
    for (Term& t : terms) t.coefficient = -t.coefficient;
    common.coefficient = -common.coefficient;
  }
  return common;
}

/// -4 (c² - a²) = 4 (a² - c²). False if the coefficient is negative and no sum can take its sign.
bool Simplifier::turn_positive(Term& term) {
  if (term.coefficient.sign() >= 0) return true;
  const auto odd_sum = std::find_if(term.factors.begin(), term.factors.end(), [&](const Factor& f) {
    return atom(f.atom).kind == AtomKind::sum && f.exponent.get_den() == 1 &&
           mpz_odd_p(f.exponent.get_num_mpz_t()) != 0;
  });
  if (odd_sum == term.factors.end()) return false;
  odd_sum->atom = sum_atom(scaled(atom(odd_sum->atom).args[0], -1));
  term.coefficient = -term.coefficient;
  collect(term);
  return true;
}

/// (c Π fᵉ)^q with non-integer q: c^q moves outside if it is rational, fᵉ if it is nonnegative, as |f|^(e q).
/// A single remaining factor moves as well, since it is nonnegative where the root is defined.
void Simplifier::multiply_root(Term& term, SumId base, const mpq_class& q) {
  Sum terms = sum(base);
  if (terms.empty() || (terms.size() == 1 && !turn_positive(terms[0])))
    return NormalForms::multiply_root(term, base, q);
  const Number c = terms.size() == 1 ? terms[0].coefficient : content(terms);
  Number inside = c;
  const bool has_root = c.exact() && q.get_den().fits_ulong_p();
  if (const auto root = has_root ? exact_root(c.rational(), q.get_den().get_ui()) : std::nullopt) {
    if (const auto outside = Number::power(Number(*root), q.get_num())) {
      term.coefficient = term.coefficient * *outside;
      inside = 1;
    }
  }
  if (terms.size() == 1 && terms[0].factors.empty() && inside.exact() && inside.rational().get_den() != 1 &&
      inside.rational().get_den() <= simple_denominator &&
      abs(q) == mpq_class(1, 2)) {  // √(1/2) = √2/2, 1/√(2/3) = √6/2
    const mpq_class r = inside.rational();
    const mpz_class below = q > 0 ? r.get_den() : r.get_num();
    term.coefficient = term.coefficient * Number(mpq_class(1, below));
    return multiply_root(term, number(Number(mpq_class(r.get_num() * r.get_den()))), mpq_class(1, 2));
  }
  if (terms.size() > 1) {
    if (const auto root = perfect_power(base, q)) {
      return multiply(term, *root, 1);
    }
    for (Term& t : terms) t.coefficient = t.coefficient * *Number::power(c, -1) * inside;
    term.factors.push_back({sum_atom(intern(std::move(terms))), q});
    return;
  }
  Term rest{inside, {}};
  const bool lone = terms[0].factors.size() == 1;
  const bool definite = std::all_of(terms[0].factors.begin(), terms[0].factors.end(),
                                    [&](const Factor& f) { return never_negative(f); });
  for (const Factor& f : terms[0].factors) {
    const bool whole = f.exponent.get_den() == 1;
    const bool even = whole && mpz_even_p(f.exponent.get_num_mpz_t());
    if (!definite && !lone) {
      rest.factors.push_back(f);
    } else if (!even && !inside.is(1) && lone) {
      rest.factors.push_back(f);  // √(2x) is kept
    } else if (even) {
      multiply(term, absolute(single(f.atom)), f.exponent * q);
    } else {
      term.factors.push_back({f.atom, f.exponent * q});
    }
  }
  if (rest.coefficient.is(1) && rest.factors.empty()) return;
  const auto atom = rest.coefficient.is(1) && rest.factors.size() == 1 && rest.factors[0].exponent == 1;
  term.factors.push_back({atom ? rest.factors[0].atom : sum_atom(intern(Sum{rest})), q});
}

SumId Simplifier::rewritten_product(Term term) {
  int rounds = 0;
  for (bool changed = true; changed && rounds < most_product_rules; ++rounds) {
    changed = false;
    for (const ProductRule& rule : product_rules()) {
      if (!rule.apply(*this, term)) continue;
      settle(term);
      changed = true;
    }
  }
  if (term.coefficient.sign() == 0) return number(0);
  return finished_product(std::move(term));
}

namespace {

Expr simplified(Expr e) {
  // repeats until nothing changes; if forms alternate, takes the shortest, whichever came first
  std::vector<std::pair<double, Expr>> seen;
  const auto better = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : to_text(a.second) < to_text(b.second);
  };
  try {
    for (Expr now = e;;) {
      Simplifier forms;
      const SumId s = forms.form(now);
      const Expr next = forms.build(s);
      if (next == now) return now;
      const auto again =
          std::find_if(seen.begin(), seen.end(), [&](const auto& x) { return x.second == next; });
      if (again != seen.end()) return std::min_element(again, seen.end(), better)->second;
      if (seen.size() == most_rounds) return next;
      seen.emplace_back(forms.traits(s).tokens, next);
      now = next;
    }
  } catch (const Error&) {  // a part of e is undefined everywhere, such as 1/(x - x)
    return e;
  }
}

/// If a function contains half a symbol, e with every symbol doubled: sin((x + y)/2) with x = 2 x′, y = 2
/// y′; otherwise e.
Expr with_whole_angles(Expr e, std::span<const Expr> nodes) {
  const bool halves = std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    const mpq_class* q = exact_value(node);
    return node.op() == Op::div || (q && q->get_den() == 2);
  });
  if (!halves) return e;
  Substitution doubled;
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind != Kind::constant) doubled[leaf] = 2 * leaf;
  return simplified(substitute(e, doubled));
}

/// Do sines, cosines, hyperbolic functions and exponentials cancel by their addition theorems? They do if the
/// value at a random point of a finite field that satisfies these theorems is 0.
bool vanishes_by_addition_theorems(Expr e) {
  constexpr double longest = 400;
  if (e.is_constant() || e.is_symbol() || !is_short(e, longest) || !generic::decided_by_residues({&e, 1}))
    return false;
  const auto nodes = topological({&e, 1});
  const bool functions = std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    return !node.is_constant() && !node.is_symbol() && info(node.op()).style == Style::named;
  });
  if (!functions) return false;
  try {
    if (generic::is_zero(e)) return true;
    const Expr other = with_whole_angles(e, nodes);
    return other != e && generic::decided_by_residues({&other, 1}) && generic::is_zero(other);
  } catch (const Error&) {  // divides by an expression that vanishes everywhere
    return false;
  }
}

Expr simplified_or_zero(Expr e) {
  const Expr simple = simplified(e);
  return vanishes_by_addition_theorems(simple) ? Expr(0) : simple;
}

}  // namespace

Expr simplify(Expr e) {
  // nodes are immutable, and so are their simple forms as long as the order of symbols does not change
  constexpr std::size_t most = 250'000;  // expressions
  static thread_local LruCache<Expr, Expr, std::hash<Expr>, Refers::by_touch> known(most);
  static thread_local RewrittenPatterns patterns;
  static thread_local std::pair<std::size_t, std::uint64_t> known_under;
  if (const std::pair now(assumptions_made(), session_of_declarations()); known_under != now) {
    known.clear();
    patterns.clear();
    known_under = now;
  }
  if (e.is_constant()) return simplified(e);
  if (const Expr* simple = known.find(e)) {
    touch(*simple);
    return *simple;
  }
  const auto pattern = pattern_of(e);
  if (!pattern) return known.insert(e, simplified_or_zero(e));
  if (const auto simple = patterns.find(*pattern)) return known.insert(e, *simple);
  const Expr simple = known.insert(e, simplified_or_zero(e));
  patterns.add(*pattern, simple);
  return simple;
}

}  // namespace pendula
