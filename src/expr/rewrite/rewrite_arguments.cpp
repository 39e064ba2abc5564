// Expresses functions of related arguments by one argument: multiples of an angle, angles that differ by
// fractions of π, powers of numbers that are products of the same primes.
#include <algorithm>
#include <map>

#include "expr/graph/angle.hpp"
#include "expr/graph/fold.hpp"
#include "expr/rewrite/rewrite_forms.hpp"

namespace pendula {
namespace {

constexpr std::size_t most_related_terms = 12;  // a choice: pairs of angles in longer sums are seldom related

/// The primes of a positive rational with their exponents; a remainder without small factors counts as a
/// prime.
std::map<mpz_class, long> primes_of(const mpq_class& q) {
  std::map<mpz_class, long> primes;
  for (mpz_class n : {q.get_num(), q.get_den()}) {
    const long step = n == q.get_num() ? 1 : -1;
    for (unsigned long p = 2; p <= largest_trial_divisor && n > 1; ++p)
      for (; mpz_divisible_ui_p(n.get_mpz_t(), p); n /= p) primes[mpz_class(p)] += step;
    if (n > 1) primes[n] += step;
  }
  return primes;
}

/// The position of the rational number among the terms of a sum; the size of the sum if there is none.
std::size_t constant_term(const Sum& sum) {
  const auto it = std::find_if(sum.begin(), sum.end(),
                               [](const Term& t) { return t.factors.empty() && t.coefficient.exact(); });
  return static_cast<std::size_t>(it - sum.begin());
}

}  // namespace

Term Simplifier::with_factor(Term term, AtomId atom, const mpq_class& exponent) const {
  term.factors.push_back({atom, exponent});
  collect(term);
  return term;
}

std::optional<std::size_t> Simplifier::term_of_pi(const Sum& sum) {
  const std::vector<Factor> only_pi{{leaf_atom(pi()), 1}};
  for (std::size_t k = 0; k < sum.size(); ++k)
    if (sum[k].factors == only_pi && sum[k].coefficient.exact()) return k;
  return {};
}

std::vector<SumId> Simplifier::with_related_arguments(SumId s) {
  std::vector<SumId> written;
  for (const auto& each :
       {with_single_angles(s), with_common_shift(s), with_common_base(s), with_logarithms(s)})
    if (each) written.push_back(*each);
  return written;
}

/// sin 2A, cos 3A … in powers of sin A and cos A, if these occur as well: 2 sin x cos x - sin 2x = 0. Also
/// for cos 2x alone: 1 - cos 2x = 2 sin² x.
std::optional<SumId> Simplifier::with_single_angles(SumId s) {
  const Sum terms = sum(s);
  if (terms.size() > most_related_terms) return {};
  std::vector<SumId> angles;
  for (const Term& t : terms)
    for (const Factor& f : t.factors)
      if (is_function(f.atom, Op::sin) || is_function(f.atom, Op::cos))
        angles.push_back(atom(f.atom).args[0]);
  std::map<SumId, std::pair<SumId, int>> multiples;  // of an angle that occurs as well
  for (SumId a : angles)
    for (int k : {2, 3}) multiples.try_emplace(scaled(a, k), a, k);
  const auto multiple = [&](SumId angle) -> std::optional<std::pair<SumId, int>> {
    if (const auto known = multiples.find(angle); known != multiples.end()) return known->second;
    const Sum& inside = sum(angle);
    const bool even = std::all_of(inside.begin(), inside.end(), [](const Term& t) {
      return t.coefficient.exact() && t.coefficient.rational().get_den() == 1 &&
             mpz_even_p(t.coefficient.rational().get_num_mpz_t()) != 0;
    });
    if (even) return std::pair{scaled(angle, Number(mpq_class(1, 2))), 2};
    return {};
  };
  Sum whole;
  bool changed = false;
  for (const Term& t : terms) {
    const auto at = std::find_if(t.factors.begin(), t.factors.end(), [&](const Factor& f) {
      return (is_function(f.atom, Op::sin) || is_function(f.atom, Op::cos)) && f.exponent == 1 &&
             multiple(atom(f.atom).args[0]);
    });
    if (at == t.factors.end()) {
      whole.push_back(t);
      continue;
    }
    const auto [a, k] = *multiple(atom(at->atom).args[0]);
    const bool sine = is_function(at->atom, Op::sin);
    const AtomId si = function_atom(Op::sin, {a}), co = function_atom(Op::cos, {a});
    const Term rest = with_factor(t, at->atom, -1);
    // sin 2A = 2 s c, cos 2A = 2 c² - 1, sin 3A = 3 s - 4 s³, cos 3A = 4 c³ - 3 c
    Sum by = sine     ? k == 2 ? Sum{{2, {{si, 1}, {co, 1}}}} : Sum{{3, {{si, 1}}}, {-4, {{si, 3}}}}
                 : k == 2 ? Sum{{2, {{co, 2}}}, {-1, {}}}
                      : Sum{{4, {{co, 3}}}, {-3, {{co, 1}}}};
    for (Term& part : by) {
      collect(part);
      whole.push_back(times(rest, part));
    }
    changed = true;
  }
  return changed ? std::optional(intern(std::move(whole))) : std::nullopt;
}

/// Splits x + q π into x (with a positive first term), q and the sign of x.
Simplifier::Shifted Simplifier::shifted(SumId angle) {
  Sum terms = sum(angle);
  Shifted result{angle, 0, false};
  if (const auto place = term_of_pi(terms)) {
    result.half_turns = terms[*place].coefficient.rational();
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(*place));
    result.rest = intern(std::move(terms));
  }
  result.turned = leads_negative(result.rest);
  if (result.turned) result.rest = minus(result.rest);
  return result;
}

/// sin(x + q π), cos(x + q π) in terms of sin x and cos x, if several of these angles occur: sin x + sin(x +
/// 2 π/3) + sin(x + 4 π/3) = 0.
std::optional<SumId> Simplifier::with_common_shift(SumId s) {
  const Sum terms = sum(s);
  if (terms.size() > most_related_terms) return {};
  const auto is_wave = [&](const Factor& f) {
    return (is_function(f.atom, Op::sin) || is_function(f.atom, Op::cos)) && f.exponent >= 1 &&
           f.exponent.get_den() == 1;
  };
  std::map<SumId, std::vector<SumId>> angles;  // by the part without π
  for (const Term& t : terms)
    for (const Factor& f : t.factors) {
      if (!is_wave(f)) continue;
      const SumId angle = atom(f.atom).args[0];
      std::vector<SumId>& group = angles[shifted(angle).rest];
      if (std::find(group.begin(), group.end(), angle) == group.end()) group.push_back(angle);
    }
  Sum whole;
  bool changed = false;
  for (const Term& t : terms) {
    Term by{t.coefficient, {}};
    for (const Factor& f : t.factors) {
      const auto [x, q, turned] = is_wave(f) ? shifted(atom(f.atom).args[0]) : Shifted{};
      const auto sine = trigonometric_value(Op::sin, q), cosine = trigonometric_value(Op::cos, q);
      if (!is_wave(f) || angles[x].size() < 2 || !sine || !cosine) {
        by.factors.push_back(f);
        continue;
      }
      // sin(± x + q π) = ± sin x cos(q π) + cos x sin(q π), cos(± x + q π) = cos x cos(q π) ∓ sin x sin(q π)
      const bool of_sine = is_function(f.atom, Op::sin);
      Term first{turned && of_sine ? -1 : 1, {}}, second{turned || of_sine ? 1 : -1, {}};
      multiply(first, function(of_sine ? Op::sin : Op::cos, {x}), 1);
      multiply(first, form(*cosine), 1);
      multiply(second, function(of_sine ? Op::cos : Op::sin, {x}), 1);
      multiply(second, form(*sine), 1);
      Sum both = sum(product(std::move(first)));
      const SumId other = product(std::move(second));
      both.insert(both.end(), sum(other).begin(), sum(other).end());
      multiply(by, intern(std::move(both)), f.exponent);
      changed = true;
    }
    const SumId p = product(std::move(by));
    whole.insert(whole.end(), sum(p).begin(), sum(p).end());
  }
  return changed ? std::optional(intern(std::move(whole))) : std::nullopt;
}

/// Powers of numbers as powers of primes, if several of these numbers or numbers in exponents occur: 8^x/2^x
/// = 2^(2 x), 2^(x + 1) = 2·2^x.
std::optional<SumId> Simplifier::with_common_base(SumId s) {
  const Sum terms = sum(s);
  if (terms.size() > most_related_terms) return {};
  const auto base_of = [&](const Factor& f) -> std::optional<mpq_class> {
    if (atom(f.atom).kind != AtomKind::power || f.exponent.get_den() != 1) return {};
    const auto base = constant(atom(f.atom).args[0]);
    return base && base->exact() && base->sign() > 0 ? std::optional(base->rational()) : std::nullopt;
  };
  std::optional<mpq_class> first;
  bool related = false;
  for (const Term& t : terms)
    for (const Factor& f : t.factors)
      if (const auto base = base_of(f)) {
        const Sum& exponent = sum(atom(f.atom).args[1]);
        related = related || (first && *first != *base) || constant_term(exponent) != exponent.size();
        first = base;
      }
  if (!related) return {};
  Sum whole;
  for (const Term& t : terms) {
    Term by{t.coefficient, {}};
    for (const Factor& f : t.factors) {
      const auto base = base_of(f);
      if (!base) {
        by.factors.push_back(f);
        continue;
      }
      Sum exponent = sum(atom(f.atom).args[1]);
      if (const std::size_t k = constant_term(exponent); k < exponent.size()) {
        multiply(by, rooted(number(Number(*base)), exponent[k].coefficient.rational()), f.exponent);
        exponent.erase(exponent.begin() + static_cast<std::ptrdiff_t>(k));
      }
      const SumId rest = intern(std::move(exponent));
      for (const auto& [prime, k] : primes_of(*base))
        multiply(by, power(number(Number(mpq_class(prime))), scaled(rest, Number(k))), f.exponent);
    }
    const SumId p = product(std::move(by));
    whole.insert(whole.end(), sum(p).begin(), sum(p).end());
  }
  return intern(std::move(whole));
}

/// asinh, acosh and atanh as logarithms, if other logarithms occur.
std::optional<SumId> Simplifier::with_logarithms(SumId s) {
  const Sum terms = sum(s);
  if (terms.size() > most_related_terms) return {};
  const auto is_arc = [&](const Factor& f) {
    return is_function(f.atom, Op::asinh) || is_function(f.atom, Op::acosh) || is_function(f.atom, Op::atanh);
  };
  bool arcs = false, logarithms = false;
  for (const Term& t : terms)
    for (const Factor& f : t.factors) {
      arcs = arcs || is_arc(f);
      logarithms = logarithms || is_function(f.atom, Op::log);
    }
  if (!arcs || !logarithms) return {};
  Sum whole;
  for (const Term& t : terms) {
    Term by{t.coefficient, {}};
    for (const Factor& f : t.factors) {
      if (!is_arc(f)) {
        by.factors.push_back(f);
        continue;
      }
      const Expr x = build(atom(f.atom).args[0]);
      multiply(by,
               form(is_function(f.atom, Op::asinh)   ? log(x + sqrt(x * x + 1))
                    : is_function(f.atom, Op::acosh) ? log(x + sqrt(x * x - 1))
                                                     : log((1 + x) / (1 - x)) / 2),
               f.exponent);
    }
    const SumId p = product(std::move(by));
    whole.insert(whole.end(), sum(p).begin(), sum(p).end());
  }
  return intern(std::move(whole));
}

}  // namespace pendula
