// Rules for pairs of terms of a sum: squares of sine and cosine, their products at two angles, logarithms,
// inverse functions, fractions.
#include <algorithm>

#include "expr/graph/mix.hpp"
#include "expr/rewrite/rewrite_forms.hpp"

namespace pendula {
namespace {

constexpr int most_passes = 40;              // a cap: each pass makes the sum shorter
constexpr std::size_t most_summands = 2000;  // a choice: some rules look at pairs of terms

using Index = std::size_t;
constexpr Index nowhere = OrderedTerms::nowhere;

std::uint64_t hash_of_atoms(const Term& t) {
  std::uint64_t h = 0;
  for (const Factor& f : t.factors) h += mix(f.atom);
  return h;
}

/// The terms without these two.
Sum without_two(const OrderedTerms& terms, Index i, Index j) {
  Sum rest;
  for (Index k = 0; k < terms.size(); ++k)
    if (k != i && k != j) rest.push_back(terms[k]);
  return rest;
}
/// The terms with a product in place of these two.
Sum with_one_for_two(NormalForms& forms, const OrderedTerms& terms, Index i, Index j, Term by) {
  Sum shorter = without_two(terms, i, j);
  const SumId p = forms.product(std::move(by));
  shorter.insert(shorter.end(), forms.sum(p).begin(), forms.sum(p).end());
  return shorter;
}

}  // namespace

OrderedTerms::OrderedTerms(std::vector<Term> terms) : terms_(std::move(terms)) {
  for (Index k = 0; k < terms_.size(); ++k) places_[hash_of_atoms(terms_[k])].push_back(k);
}

std::size_t OrderedTerms::place_of(const Term& wanted, std::size_t except) const {
  const auto alike = places_.find(hash_of_atoms(wanted));
  if (alike == places_.end()) return nowhere;
  for (const Index k : alike->second)
    if (k != except && terms_[k] == wanted) return k;
  return nowhere;
}

std::size_t OrderedTerms::place_of_factors(const Term& wanted, std::size_t except) const {
  const auto alike = places_.find(hash_of_atoms(wanted));
  if (alike == places_.end()) return nowhere;
  for (const Index k : alike->second)
    if (k != except && terms_[k].factors == wanted.factors) return k;
  return nowhere;
}

/// α c R f² + β c R g² = c R, and c R - α c R f² = β c R g²; a R f² + b R g² with numbers 0 < a < b is
/// a R + (b - a) R g² for sine and cosine.
std::optional<Sum> Simplifier::by_squares(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i) {
    const Term& t = terms[i];
    for (const SquareRule& rule : square_rules())
      for (const Factor& f : t.factors) {
        const bool is_f = is_function(f.atom, rule.f), is_g = is_function(f.atom, rule.g);
        if ((!is_f && !is_g) || f.exponent < 2) continue;
        const int mine = is_f ? rule.alpha : rule.beta, theirs = is_f ? rule.beta : rule.alpha;
        Term rest = with_factor(t, f.atom, -2);  // t = mine · c R · square
        rest.coefficient = rest.coefficient * Number(mine);
        Term other = rest;  // theirs · c R · other square
        other.coefficient = other.coefficient * Number(theirs);
        other = with_factor(other, function_atom(is_f ? rule.g : rule.f, atom(f.atom).args), 2);
        if (const Index j = terms.place_of(other, i); j != nowhere)
          return with_one_for_two(*this, terms, i, j, rest);
        Term opposite = rest;
        opposite.coefficient = -opposite.coefficient;
        Term remaining = other;
        remaining.coefficient = -remaining.coefficient;
        if (const Index j = terms.place_of(opposite, i); j != nowhere)
          return with_one_for_two(*this, terms, i, j, remaining);
        const Index j = rule.f == Op::sin ? terms.place_of_factors(other, i) : nowhere;
        if (j == nowhere || terms[j].coefficient.sign() != t.coefficient.sign()) continue;
        const Number more = terms[j].coefficient + -t.coefficient;
        if (!more.exact() || more.sign() != t.coefficient.sign()) continue;
        Sum shorter = with_one_for_two(*this, terms, i, j, rest);
        shorter.push_back({more, other.factors});
        return shorter;
      }
  }
  return {};
}

/// c R cos a cos b ± c R sin a sin b = c R cos(a ∓ b), c R sin a cos b ± c R cos a sin b = c R sin(a ± b).
std::optional<Sum> Simplifier::by_angle_sums(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i) {
    const Term& t = terms[i];
    for (const Factor& x : t.factors)
      for (const Factor& y : t.factors) {
        if (x.atom == y.atom || x.exponent < 1 || y.exponent < 1 || !is_function(y.atom, Op::cos)) continue;
        const bool both_cos = is_function(x.atom, Op::cos);
        if (!both_cos && !is_function(x.atom, Op::sin)) continue;
        const SumId a = atom(x.atom).args[0], b = atom(y.atom).args[0];
        if (a == b) continue;
        const Term rest = with_factor(with_factor(t, x.atom, -1), y.atom, -1);
        Term other = with_factor(rest, function_atom(both_cos ? Op::sin : Op::cos, {a}), 1);
        other = with_factor(other, function_atom(Op::sin, {b}), 1);
        Index j = terms.place_of(other, i);
        const bool same = j != nowhere;
        other.coefficient = -other.coefficient;
        if (!same) j = terms.place_of(other, i);
        if (j == nowhere) continue;
        const bool difference = both_cos == same;  // cos(a - b), sin(a - b)
        Sum angle = sum(a);
        const SumId turned = difference ? minus(b) : b;
        angle.insert(angle.end(), sum(turned).begin(), sum(turned).end());
        Term by = rest;
        multiply(by, function(both_cos ? Op::cos : Op::sin, {intern(std::move(angle))}), 1);
        return with_one_for_two(*this, terms, i, j, std::move(by));
      }
  }
  return {};
}

/// c R + c R tan² = c R/cos², c R - c R tanh² = c R/cosh².
std::optional<Sum> Simplifier::by_tangents(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i)
    for (const Factor& f : terms[i].factors) {
      const bool circular = is_function(f.atom, Op::tan);
      if (f.exponent != 2 || (!circular && !is_function(f.atom, Op::tanh))) continue;
      Term rest = with_factor(terms[i], f.atom, -2);
      if (!circular) rest.coefficient = -rest.coefficient;
      const Index j = terms.place_of(rest, i);
      if (j == nowhere) continue;
      Term by = rest;
      multiply(by, single(function_atom(circular ? Op::cos : Op::cosh, atom(f.atom).args)), -2);
      return with_one_for_two(*this, terms, i, j, std::move(by));
    }
  return {};
}

/// c R log a ± c R log b = c R log(a b^±1): where the left side is defined, a and b are positive.
std::optional<Sum> Simplifier::by_logarithms(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i)
    for (const Factor& f : terms[i].factors) {
      if (f.exponent != 1 || !is_function(f.atom, Op::log)) continue;
      const Term rest = with_factor(terms[i], f.atom, -1);
      for (Index j = i + 1; j < terms.size(); ++j)
        for (const Factor& g : terms[j].factors) {
          if (g.exponent != 1 || !is_function(g.atom, Op::log)) continue;
          const Term other = with_factor(terms[j], g.atom, -1);
          Term opposite = other;
          opposite.coefficient = -opposite.coefficient;
          if (!(other == rest) && !(opposite == rest)) continue;
          Term inside{1, {}};
          multiply(inside, atom(f.atom).args[0], 1);
          multiply(inside, atom(g.atom).args[0], other == rest ? 1 : -1);
          Term by = rest;
          multiply(by, function(Op::log, {product(std::move(inside))}), 1);
          return with_one_for_two(*this, terms, i, j, std::move(by));
        }
    }
  return {};
}

/// c R asin u + c R acos u = c R π/2, c R atan u + c R atan(1/u) = c R π sign(u)/2. With coefficients a, b of
/// one sign before asin and acos the excess of the larger one remains.
std::optional<Sum> Simplifier::by_arcs(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i)
    for (const Factor& f : terms[i].factors) {
      const bool sine = is_function(f.atom, Op::asin);
      if (f.exponent != 1 || (!sine && !is_function(f.atom, Op::atan))) continue;
      const SumId u = atom(f.atom).args[0];
      Term other = with_factor(terms[i], f.atom, -1);
      Term by = other;
      multiply(other, function(sine ? Op::acos : Op::atan, {sine ? u : rooted(u, -1)}), 1);
      collect(other);
      const Index j = sine ? terms.place_of_factors(other, i) : terms.place_of(other, i);
      if (j == nowhere) continue;
      const Number &a = terms[i].coefficient, &b = terms[j].coefficient;
      if (!a.exact() || !b.exact() || a.sign() != b.sign()) continue;
      const bool first = abs(a.rational()) > abs(b.rational());
      by.coefficient = first ? b : a;
      Sum shorter = without_two(terms, i, j);
      shorter.push_back({(first ? a : b) + -by.coefficient, terms[first ? i : j].factors});
      multiply(by, scaled(single(leaf_atom(pi())), Number(mpq_class(1, 2))), 1);
      const auto lone = lone_atom(u);
      if (!sine && !(lone && never_negative({*lone, 1}))) multiply(by, function(Op::sign, {u}), 1);
      const SumId p = product(std::move(by));
      shorter.insert(shorter.end(), sum(p).begin(), sum(p).end());
      return shorter;
    }
  return {};
}

/// c R max(x, y) + c R min(x, y) = c R (x + y), c R max(x, y) - c R min(x, y) = c R |x - y|.
std::optional<Sum> Simplifier::by_extremes(const OrderedTerms& terms) {
  for (Index i = 0; i < terms.size(); ++i)
    for (const Factor& f : terms[i].factors) {
      if (f.exponent != 1 || !is_function(f.atom, Op::max)) continue;
      const SumId x = atom(f.atom).args[0], y = atom(f.atom).args[1];
      Term by = with_factor(terms[i], f.atom, -1);
      Index j = terms.place_of(with_factor(by, function_atom(Op::min, {x, y}), 1), i);
      if (j == nowhere) j = terms.place_of(with_factor(by, function_atom(Op::min, {y, x}), 1), i);
      const bool plus = j != nowhere;
      Term opposite = by;
      opposite.coefficient = -opposite.coefficient;
      if (!plus) j = terms.place_of(with_factor(opposite, function_atom(Op::min, {x, y}), 1), i);
      if (j == nowhere) continue;
      Sum both = sum(x);
      const SumId other = plus ? y : minus(y);
      both.insert(both.end(), sum(other).begin(), sum(other).end());
      const SumId whole = intern(std::move(both));
      multiply(by, plus ? whole : absolute(whole), 1);
      return with_one_for_two(*this, terms, i, j, std::move(by));
    }
  return {};
}

SumId Simplifier::by_sum_rules(SumId id) {
  for (int round = 0; round < most_passes; ++round) {
    const OrderedTerms terms(ordered_terms(id));
    if (terms.size() < 2 || terms.size() > most_summands) break;
    auto shorter = by_squares(terms);
    if (!shorter) shorter = by_angle_sums(terms);
    if (!shorter) shorter = by_tangents(terms);
    if (!shorter) shorter = by_logarithms(terms);
    if (!shorter) shorter = by_arcs(terms);
    if (!shorter) shorter = by_extremes(terms);
    if (!shorter) break;
    id = intern(std::move(*shorter));
  }
  return id;
}

/// a + b/(c + d) = (a (c + d) + b)/(c + d) for a single denominator that is a sum; the numerator
/// is multiplied out.
std::optional<SumId> Simplifier::over_common_denominator(SumId s) {
  const std::vector<Term> terms = ordered_terms(s);
  constexpr std::size_t most = 12;  // terms: a choice, as the numerator is multiplied out
  if (terms.size() < 2 || terms.size() > most) return {};
  for (const Term& t : terms)
    for (const Factor& f : t.factors) {
      if (atom(f.atom).kind != AtomKind::sum || f.exponent != -1) continue;
      Sum numerator;
      for (const Term& u : terms) {
        const auto out = multiplied_out(with_factor(u, f.atom, 1), most * most);
        if (!out) return {};
        numerator.insert(numerator.end(), out->begin(), out->end());
      }
      Term quotient{1, {{f.atom, -1}}};
      multiply(quotient, by_sum_rules(intern(std::move(numerator))), 1);
      return quotient.coefficient.sign() == 0 ? number(0) : product(std::move(quotient));
    }
  return {};
}

}  // namespace pendula
