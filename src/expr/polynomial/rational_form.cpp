#include "expr/polynomial/rational_form.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/polynomial/polynomial.hpp"

namespace pendula {
namespace {

// bounds that limit every computation to about ten milliseconds
constexpr std::size_t most_generators = 32, most_terms = 600, most_factored_terms = 120;
constexpr double most_expanded = 20'000;
constexpr long highest_power = 40, most_factored_degree = 24;
constexpr int deepest = 2000;  // nested sums; deeper ones mostly exceed most_terms

/// Numerator and denominator, not necessarily coprime.
struct Fraction {
  Polynomial above, below;
};

/// Thrown for forms that are not handled as rational functions.
struct Unsuitable {};

class Conversion {
 public:
  explicit Conversion(NormalForms& forms) : forms_(forms) {}

  /// Finds the generators of the sums to be converted.
  void prepare(std::span<const SumId> sums) {
    if (!have_polynomials()) throw Unsuitable();
    for (SumId s : sums) visit(s);
    if (generators_.size() > most_generators) throw Unsuitable();
    std::vector<AtomId> order;
    for (const auto& [atom, root] : generators_) order.push_back(atom);
    std::sort(order.begin(), order.end(), [&](AtomId a, AtomId b) { return before(a, b); });
    for (std::size_t i = 0; i < order.size(); ++i) place_[order[i]] = i;
    atoms_ = std::move(order);
    ring_ = polynomial_ring(atoms_.size());
    relations();
  }

  Fraction fraction(SumId s) {
    check_stack();
    if (const auto known = known_.find(s); known != known_.end()) return known->second;
    Fraction sum{constant(0), constant(1)};
    for (const Term& t : forms_.sum(s)) {
      poll_interrupt();
      sum = added(sum, fraction(t));
      check(sum);
    }
    return known_.insert_or_assign(s, sum).first->second;
  }

  static Fraction coprime(const Fraction& f) {
    if (f.above.is_zero()) return f;
    const auto common = gcd(f.above, f.below);
    if (!common || common->is_one()) return f;
    return {*quotient(f.above, *common), *quotient(f.below, *common)};
  }

  /// p reduced by the relations; unchanged if the result would be far too long, as for (Σ dᵢ²)^(3/2)
  /// of many bodies.
  Polynomial reduced(const Polynomial& p) const {
    return expanded_terms(p) <= most_expanded ? remainder(p, basis_) : p;
  }

  SumId sum(const Polynomial& p) {
    Sum terms;
    for (const Monomial& m : p.terms()) {
      Term t{Number(m.coefficient), {}};
      for (std::size_t i = 0; i < atoms_.size(); ++i)
        if (m.exponents[i] > 0)
          t.factors.push_back({atoms_[i], mpq_class(m.exponents[i], generators_.at(atoms_[i]))});
      for (Factor& f : t.factors) f.exponent.canonicalize();
      forms_.collect(t);
      terms.push_back(std::move(t));
    }
    return forms_.intern(std::move(terms));
  }

  Polynomial constant(const mpq_class& c) const { return Polynomial::constant(ring_, c); }
  /// Does p start with a minus? Then -p is preferred: -1/(a - b).
  bool leads_with_minus(const Polynomial& p) {
    return forms_.ordered_terms(sum(p))[0].coefficient.sign() < 0;
  }

 private:
  bool is_inner_sum(const Factor& f) const {
    return forms_.atom(f.atom).kind == AtomKind::sum && f.exponent.get_den() == 1;
  }

  /// Collects the generators; for a root, the least common denominator of its exponents.
  void visit(SumId s, int depth = 0) {
    if (depth > deepest) throw Unsuitable();
    check_stack();
    if (!seen_.insert({s, true}).second) return;
    if (forms_.sum(s).size() > most_terms) throw Unsuitable();
    for (const Term& t : forms_.sum(s)) {
      if (!t.coefficient.exact()) throw Unsuitable();
      for (const Factor& f : t.factors) {
        if (abs(f.exponent) > highest_power || !f.exponent.get_den().fits_slong_p()) throw Unsuitable();
        const Atom& a = forms_.atom(f.atom);
        if (a.kind == AtomKind::opaque) throw Unsuitable();
        if (a.kind == AtomKind::sum) visit(a.args[0], depth + 1);
        if (is_inner_sum(f)) continue;
        auto [at, added] = generators_.insert({f.atom, 1});
        mpz_class common;
        mpz_lcm(common.get_mpz_t(), mpz_class(at->second).get_mpz_t(), f.exponent.get_den_mpz_t());
        if (common > highest_power) throw Unsuitable();
        at->second = common.get_si();
      }
    }
  }

  /// Roots before their arguments, sines before cosines: these are the leading terms of the relations.
  bool before(AtomId a, AtomId b) const {
    const auto rank = [&](AtomId x) {
      const Atom& atom = forms_.atom(x);
      if (atom.kind == AtomKind::sum) return 0;
      if (atom.kind == AtomKind::function && atom.op == Op::sin) return 1;
      return 2;
    };
    const int ra = rank(a), rb = rank(b);
    if (ra != rb) return ra < rb;
    const int depth_a = forms_.atom(a).traits.depth, depth_b = forms_.atom(b).traits.depth;
    if (ra == 0 && depth_a != depth_b) return depth_a > depth_b;
    return forms_.compare(a, b) < 0;
  }

  /// An upper bound of the number of terms of p after replacing every power of a leading generator by
  /// its relation once.
  double expanded_terms(const Polynomial& p) const {
    double all = 0;
    std::vector<std::pair<std::size_t, Monomial>> leading;
    for (const Polynomial& relation : basis_)
      leading.emplace_back(relation.size() - 1, relation.terms().front());
    for (const Monomial& m : p.terms()) {
      double terms = 1;
      for (const auto& [others, first] : leading)
        for (std::size_t i = 0; i < m.exponents.size(); ++i)
          if (const unsigned long d = first.exponents[i]; d > 0 && m.exponents[i] >= d)
            for (std::size_t k = 1; k < others;
                 ++k)  // monomials of degree n in k variables: (n + k - 1 over k - 1)
              terms *= 1 + static_cast<double>(m.exponents[i] / d) / static_cast<double>(k);
      all += terms;
    }
    return all;
  }

  Polynomial generator(std::size_t place, unsigned long exponent) const {
    Monomial m{1, std::vector<unsigned long>(atoms_.size(), 0)};
    m.exponents[place] = exponent;
    return Polynomial(ring_, {m});
  }

  /// rᵈ = a for roots of sums that are polynomials, s² = 1 - c².
  void relations() {
    for (AtomId id : atoms_) {
      const Atom a = forms_.atom(id);
      if (a.kind == AtomKind::sum) {
        const Fraction inside = fraction(a.args[0]);
        if (!inside.below.is_one()) continue;
        const auto d = static_cast<unsigned long>(generators_.at(id));
        basis_.push_back(generator(place_.at(id), d) + constant(-1) * inside.above);
      } else if (a.kind == AtomKind::function && a.op == Op::sin) {
        const AtomId cosine = forms_.function_atom(Op::cos, a.args);
        if (!place_.contains(cosine)) continue;
        if (generators_.at(id) != 1 || generators_.at(cosine) != 1) continue;
        basis_.push_back(generator(place_.at(id), 2) + generator(place_.at(cosine), 2) + constant(-1));
      }
    }
  }

  Fraction fraction(const Term& t) {
    Fraction product{constant(t.coefficient.rational()), constant(1)};
    for (const Factor& f : t.factors) {
      Fraction base{constant(1), constant(1)};
      unsigned long n = 0;
      if (is_inner_sum(f)) {
        base = fraction(forms_.atom(f.atom).args[0]);
        n = mpz_class(abs(f.exponent.get_num())).get_ui();
      } else {
        base.above = generator(place_.at(f.atom), 1);
        n = mpz_class(abs(f.exponent.get_num()) * generators_.at(f.atom) / f.exponent.get_den()).get_ui();
      }
      if (f.exponent < 0) std::swap(base.above, base.below);
      if (base.below.is_zero()) throw Unsuitable();  // undefined everywhere
      constexpr unsigned long most = 12;             // a choice: (a + b + c)¹² has 91 terms
      if (base.above.size() > 1 && n > most) throw Unsuitable();
      product.above = product.above * base.above.power(n);
      product.below = product.below * base.below.power(n);
      check(product);
    }
    return product;
  }

  static Fraction added(const Fraction& a, const Fraction& b) {
    if (a.above.is_zero()) return b;
    const auto common = gcd(a.below, b.below);
    if (!common) throw Unsuitable();
    const Polynomial left = *quotient(b.below, *common), right = *quotient(a.below, *common);
    return {a.above * left + b.above * right, a.below * left};
  }

  static void check(const Fraction& f) {
    if (f.above.size() > most_terms || f.below.size() > most_terms) throw Unsuitable();
  }

  NormalForms& forms_;
  std::map<AtomId, long> generators_;  ///< atom -> d: the generator is its d-th root
  std::unordered_map<AtomId, std::size_t> place_;
  std::vector<AtomId> atoms_;
  std::unordered_map<SumId, bool> seen_;
  std::unordered_map<SumId, Fraction> known_;
  std::vector<Polynomial> basis_;
  RingPtr ring_;
};

bool is_factorable(const Polynomial& p) {
  return p.size() <= most_factored_terms && p.total_degree() <= most_factored_degree;
}

/// Adds p^(±1): as irreducible factors, or as one.
void append(RationalForm& form, Conversion& conversion, const Polynomial& p, long sign, bool factor) {
  if (p.is_constant()) {
    const mpq_class c = p.terms()[0].coefficient;
    form.coefficient *= sign > 0 ? c : 1 / c;
    return;
  }
  const auto put = [&](const Polynomial& base, long n) {
    const bool turned = conversion.leads_with_minus(base);
    if (turned && n % 2 != 0) form.coefficient = -form.coefficient;
    form.powers.push_back({conversion.sum(turned ? conversion.constant(-1) * base : base), sign * n});
  };
  if (const auto factors = factor && is_factorable(p) ? p.factors() : std::nullopt) {
    form.coefficient *= sign > 0 ? factors->constant : 1 / factors->constant;
    for (const auto& [base, n] : factors->powers) put(base, static_cast<long>(n));
  } else {
    put(p, 1);
  }
}

/// The shorter fraction, with or without the relations.
Fraction shortest(Conversion& conversion, const Fraction& given) {
  const Fraction plain = Conversion::coprime(given);
  const Polynomial above = conversion.reduced(given.above);
  if (above.is_zero()) return {above, plain.below};
  const Polynomial below = conversion.reduced(given.below);
  if (below.is_zero()) return plain;  // a division by zero, left to evaluation
  const Fraction other = Conversion::coprime({above, below});
  return other.above.size() + other.below.size() < plain.above.size() + plain.below.size() ? other : plain;
}

[[noreturn]] void refuse() {
  require_polynomials();
  throw Error(
      "the expression is too long for factors and common denominators, or contains decimals that are not exact");
}

}  // namespace

std::optional<RationalForm> rational_form(NormalForms& forms, SumId s, Factoring factoring) {
  try {
    Conversion conversion(forms);
    conversion.prepare({&s, 1});
    const Fraction f = shortest(conversion, conversion.fraction(s));
    if (f.above.is_zero()) return RationalForm{0, {}};
    RationalForm form;
    append(form, conversion, f.above, 1, factoring == Factoring::both);
    append(form, conversion, f.below, -1, true);
    return form;
  } catch (const Unsuitable&) {
    return {};
  }
}

std::optional<SumId> common_divisor(NormalForms& forms, SumId a, SumId b) {
  try {
    const SumId both[] = {a, b};
    Conversion conversion(forms);
    conversion.prepare(both);
    const Fraction fa = conversion.fraction(a), fb = conversion.fraction(b);
    const auto common = gcd(fa.above, fb.above);
    if (!common || common->is_constant()) return {};
    return conversion.sum(*common);
  } catch (const Unsuitable&) {
    return {};
  }
}

namespace {

Expr built(NormalForms& forms, const RationalForm& form, int sign) {
  Expr product = 1;
  for (const auto& [base, exponent] : form.powers)
    if ((exponent > 0) == (sign > 0)) product *= pow(forms.build(base), Expr(std::labs(exponent)));
  return product;
}

RationalForm required(NormalForms& forms, Expr e, Factoring factoring) {
  const auto form = rational_form(forms, forms.form(e), factoring);
  if (!form) refuse();
  return *form;
}

}  // namespace

Quotient quotient_of(Expr e) {
  NormalForms forms;
  const SumId s = forms.form(e);
  try {
    Conversion conversion(forms);
    conversion.prepare({&s, 1});
    const Fraction f = shortest(conversion, conversion.fraction(s));
    if (f.above.is_zero()) return {0, 1};
    const Polynomial sign = conversion.constant(conversion.leads_with_minus(f.below) ? -1 : 1);
    return {forms.build(conversion.sum(sign * f.above)), forms.build(conversion.sum(sign * f.below))};
  } catch (const Unsuitable&) {
    refuse();
  }
}

Expr factored(Expr e) {
  NormalForms forms;
  const RationalForm form = required(forms, e, Factoring::both);
  if (form.coefficient == 0) return 0;
  const Expr above = Expr(mpq_class(form.coefficient.get_num())) * built(forms, form, 1);
  const Expr below = Expr(mpq_class(form.coefficient.get_den())) * built(forms, form, -1);
  return above / below;
}

std::vector<std::pair<Expr, long>> numerator_factors(Expr e) {
  NormalForms forms;
  const RationalForm form = required(forms, e, Factoring::both);
  std::vector<std::pair<Expr, long>> list;
  for (const auto& [base, exponent] : form.powers)
    if (exponent > 0) list.emplace_back(forms.build(base), exponent);
  return list;
}

std::optional<std::vector<Expr>> polynomial_coefficients(Expr e, Expr x) {
  const Quotient q = quotient_of(e);
  if (depends_on(q.denominator, x)) return {};
  NormalForms forms;
  const AtomId leaf = forms.leaf_atom(x);
  std::map<long, Sum> by_degree;
  for (Term t : forms.sum(forms.form(q.numerator))) {
    long degree = 0;
    for (auto f = t.factors.begin(); f != t.factors.end(); ++f) {
      if (f->atom != leaf) continue;
      if (f->exponent < 0 || f->exponent.get_den() != 1 || f->exponent > 1'000'000) return {};
      degree = f->exponent.get_num().get_si();
      t.factors.erase(f);
      break;
    }
    by_degree[degree].push_back(std::move(t));
  }
  std::vector<Expr> list;
  for (auto& [degree, terms] : by_degree) {
    const Expr c = forms.build(forms.intern(std::move(terms)));
    if (depends_on(c, x)) return {};
    list.resize(static_cast<std::size_t>(degree), Expr(0));
    list.push_back(c / q.denominator);
  }
  if (list.empty()) list.push_back(0);
  return list;
}

std::vector<SeparatedTerm> separated_terms(Expr e, Expr x) {
  NormalForms forms;
  std::vector<SeparatedTerm> list;
  for (const Term& t : forms.ordered_terms(forms.form(e))) {
    SeparatedTerm separated{t.coefficient.expr(), {}};
    for (const Factor& f : forms.ordered_factors(t)) {
      const Expr base = forms.build(forms.single(f.atom));
      if (depends_on(base, x))
        separated.factors.emplace_back(base, f.exponent);
      else
        separated.coefficient = separated.coefficient * pow(base, Expr(f.exponent));
    }
    list.push_back(std::move(separated));
  }
  return list;
}

}  // namespace pendula
