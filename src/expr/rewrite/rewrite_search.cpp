// Searches for shorter forms of a sum: products are multiplied out if terms then cancel, and grouped if they
// have a common factor.
#include <cmath>

#include "base/interrupt.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/rewrite/rewrite_forms.hpp"

namespace pendula {
namespace {

// Choices that bound the work of a sum; longer sums are collected, but not searched for common factors. The
// steps of all searches of one simplify together are at most work_limit.
constexpr std::size_t searched_terms = 200;
constexpr std::size_t multiplied_terms = 500;  // per product
constexpr std::size_t multiplied_products = 12;
constexpr std::size_t grouping_factors = 24;
constexpr std::size_t quotient_terms = 400;
constexpr double work_limit = 5e6;

/// The number of terms of a product when multiplied out, without collecting.
double multiplied_size(const NormalForms& forms, const Term& term) {
  double size = 1;
  for (const Factor& f : term.factors) {
    if (!forms.multiplies_out(f)) continue;
    const Atom& a = forms.atom(f.atom);
    const double n = static_cast<double>(forms.sum(a.args[0]).size());
    size *= std::pow(n, f.exponent.get_num().get_d());
  }
  return size;
}

/// Lexicographic order of monomials: the greater has the higher power of the first atom in which they differ.
bool greater_monomial(const Term& a, const Term& b) {
  auto x = a.factors.begin(), y = b.factors.begin();
  for (; x != a.factors.end() && y != b.factors.end(); ++x, ++y) {
    if (x->atom != y->atom) return x->atom < y->atom;
    if (x->exponent != y->exponent) return x->exponent > y->exponent;
  }
  return x != a.factors.end();
}

bool is_polynomial(const Sum& terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& t) {
    return std::all_of(t.factors.begin(), t.factors.end(),
                       [](const Factor& f) { return f.exponent > 0 && f.exponent.get_den() == 1; });
  });
}

const Term& leading(const Sum& terms) {
  return *std::min_element(terms.begin(), terms.end(), greater_monomial);
}

}  // namespace

std::optional<Sum> Simplifier::multiplied_out(const Term& term, std::size_t limit) {
  Sum done, open{term};
  while (!open.empty()) {
    Term t = std::move(open.back());
    open.pop_back();
    const auto it =
        std::find_if(t.factors.begin(), t.factors.end(), [&](const Factor& f) { return multiplies_out(f); });
    if (it == t.factors.end()) {
      done.push_back(std::move(t));
    } else {
      const SumId inside = atom(it->atom).args[0];
      if (it->exponent > limit) return {};  // one step per power, even if the sum has one term
      it->exponent -= 1;
      if (it->exponent == 0) t.factors.erase(it);
      for (const Term& part : sum(inside)) {
        Term product = times(t, part);
        open.push_back(std::move(product));
        if (++work_; done.size() + open.size() > limit || work_ > work_limit) return {};
      }
    }
  }
  return done;
}

std::optional<SumId> Simplifier::exact_quotient(SumId a, SumId b) {
  const Sum divisor = sum(b);
  Sum rest = sum(a), quotient;
  if (divisor.empty() || rest.size() < divisor.size() || rest.size() > searched_terms) return {};
  if (!is_polynomial(divisor) || !is_polynomial(rest)) return {};
  const Term lead = leading(divisor);
  const auto inverse = Number::power(lead.coefficient, -1);
  if (!inverse || !lead.coefficient.exact()) return {};
  while (!rest.empty()) {
    Term q = leading(rest);
    q.coefficient = q.coefficient * *inverse;
    for (const Factor& f : lead.factors) q.factors.push_back({f.atom, -f.exponent});
    collect(q);
    if (!is_polynomial({q}) || quotient.size() > quotient_terms) return {};
    for (const Term& t : divisor) {
      Term product{-(t.coefficient * q.coefficient), t.factors};
      product.factors.insert(product.factors.end(), q.factors.begin(), q.factors.end());
      collect(product);
      rest.push_back(std::move(product));
    }
    rest = sum(intern(std::move(rest)));
    quotient.push_back(std::move(q));
    work_ += static_cast<double>(divisor.size());
  }
  return intern(std::move(quotient));
}

// ── candidates ─────────────────────────────────────────────────────────────────────────────────────────────

/// The products multiplied out: the shortest one, the two shortest, and so on.
void Simplifier::expanded(SumId s, std::vector<SumId>& candidates) {
  const std::vector<Term> terms = ordered_terms(s);
  std::vector<std::pair<double, std::size_t>> sizes;
  for (std::size_t i = 0; i < terms.size(); ++i)
    if (multiplies_out(terms[i])) sizes.emplace_back(multiplied_size(*this, terms[i]), i);
  std::stable_sort(sizes.begin(), sizes.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<bool> out(terms.size(), false);
  Sum result;
  for (std::size_t k = 0; k < std::min(sizes.size(), multiplied_products); ++k) {
    const auto [size, i] = sizes[k];
    auto more = multiplied_out(terms[i], multiplied_terms);
    if (!more) return;
    out[i] = true;
    result.insert(result.end(), more->begin(), more->end());
    Sum whole = result;
    for (std::size_t j = 0; j < terms.size(); ++j)
      if (!out[j]) whole.push_back(terms[j]);
    candidates.push_back(intern(std::move(whole)));
  }
}

SumId Simplifier::with_grouped(const Sum& terms, const std::vector<Factor>& common,
                               const std::vector<std::size_t>& members) {
  Sum rest, inside;
  auto member = members.begin();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (member == members.end() || *member != i) {
      rest.push_back(terms[i]);
      continue;
    }
    ++member;
    Term t = terms[i];
    for (const Factor& f : common) t.factors.push_back({f.atom, -f.exponent});
    collect(t);
    inside.push_back(std::move(t));
  }
  Term group{1, common};
  multiply(group, by_sum_rules(intern(std::move(inside))), 1);
  const SumId product_id = product(std::move(group));
  rest.insert(rest.end(), sum(product_id).begin(), sum(product_id).end());
  return intern(std::move(rest));
}

/// Groups terms by a common factor, terms that differ in their parameters only, as in (M + m) x″, or by
/// a common denominator.
void Simplifier::grouped(SumId s, std::vector<SumId>& candidates) {
  const std::vector<Term> terms = ordered_terms(s);
  if (terms.size() < 2) return;
  struct Group {
    std::vector<Factor> common;
    std::vector<std::size_t> members;
  };
  std::vector<Group> groups;
  const auto join = [&](std::vector<Factor> common, std::size_t i) {
    if (common.empty()) return;
    const auto it =
        std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.common == common; });
    if (it == groups.end()) {
      groups.push_back({std::move(common), {i}});
    } else {
      it->members.push_back(i);
    }
  };
  for (std::size_t i = 0; i < terms.size(); ++i) {
    std::vector<Factor> moving;
    for (const Factor& f : ordered_factors(terms[i])) {
      if (atom(f.atom).traits.level >= 1) moving.push_back(f);
      if (atom(f.atom).kind == AtomKind::sum && f.exponent < 0) join({f}, i);
    }
    if (!terms[i].factors.empty()) join(std::move(moving), i);
  }
  std::erase_if(groups, [](const Group& g) { return g.members.size() < 2; });
  if (groups.size() > grouping_factors) groups.resize(grouping_factors);
  for (const Group& g : groups) candidates.push_back(with_grouped(terms, g.common, g.members));
  Term whole{1, {}};
  multiply(whole, s, 1);
  if (whole.factors.size() > 1) candidates.push_back(product(std::move(whole)));  // 2 x + 2 y stays
  work_ += static_cast<double>(terms.size() * candidates.size());
}

/// One quotient of coprime polynomials in factors over ℚ: 1/(x - 1) - 1/(x + 1) = 2/((x - 1) (x + 1)), and x²
/// + 2 x y + y² = (x + y)². Empty if it is unlikely to be shorter or too expensive.
std::optional<SumId> Simplifier::in_factors(SumId s) {
  // choices: FLINT needs milliseconds, and longer sums seldom become shorter
  constexpr std::size_t fewest = 2, most = 12;
  constexpr double longest = 120;  // tokens
  const Sum& terms = sum(s);
  if (terms.size() < fewest || terms.size() > most || traits(s).tokens > longest) return {};
  int quotients = 0, powers = 0;
  for (const Term& t : terms) {
    bool quotient = false;
    for (const Factor& f : t.factors) {
      quotient = quotient || (f.exponent < 0 && atom(f.atom).kind == AtomKind::sum);
      powers += f.exponent > 1 && f.exponent.get_den() == 1 && atom(f.atom).kind == AtomKind::leaf;
    }
    quotients += quotient;
  }
  if (quotients == 0 && (powers < 2 || terms.size() < 3)) return {};
  const auto form = rational_form(*this, s, Factoring::both);
  if (!form) return {};
  if (form->coefficient == 0) return number(0);
  Term whole{Number(form->coefficient), {}};
  for (const auto& [base, exponent] : form->powers) multiply(whole, base, exponent);
  return product(std::move(whole));
}

/// √(x² + 2 x + 1) = |x + 1|: the root of a sum that is an even power.
/// √(a + b √n) = √((a + r)/2) ± √((a - r)/2) where r² = a² - n b² is the square of a rational number.
static std::optional<SumId> nested_root(Simplifier& s, const Sum& terms) {
  const bool first = terms[0].factors.empty();
  const Term &number = terms[first ? 0 : 1], &root = terms[first ? 1 : 0];
  if (!number.factors.empty() || root.factors.size() != 1 || root.factors[0].exponent != mpq_class(1, 2) ||
      s.atom(root.factors[0].atom).kind != AtomKind::sum || !number.coefficient.exact() ||
      !root.coefficient.exact())
    return {};
  const auto inside = s.constant(s.atom(root.factors[0].atom).args[0]);
  if (!inside || !inside->exact()) return {};
  const mpq_class a = number.coefficient.rational(), b = root.coefficient.rational();
  const mpq_class d = a * a - b * b * inside->rational();
  if (a <= 0 || d < 0 || mpz_perfect_square_p(d.get_num_mpz_t()) == 0 ||
      mpz_perfect_square_p(d.get_den_mpz_t()) == 0)
    return {};
  const mpq_class r(sqrt(d.get_num()), sqrt(d.get_den()));
  const mpq_class half(1, 2), larger = (a + r) / 2, smaller = (a - r) / 2;
  Sum sum = s.sum(s.rooted(s.number(Number(larger)), half));
  const SumId second = s.scaled(s.rooted(s.number(Number(smaller)), half), Number(b > 0 ? 1 : -1));
  sum.insert(sum.end(), s.sum(second).begin(), s.sum(second).end());
  return s.intern(std::move(sum));
}

std::optional<SumId> Simplifier::perfect_power(SumId base, const mpq_class& exponent) {
  constexpr std::size_t fewest = 3, most = 6;  // terms of squares and cubes of sums of two, squares of three
  const Sum& terms = sum(base);
  if (terms.size() == 2 && exponent == mpq_class(1, 2))
    if (const auto roots = nested_root(*this, terms)) return roots;
  if (exponent.get_den() != 2 || terms.size() < fewest || terms.size() > most) return {};
  const auto squares = std::count_if(terms.begin(), terms.end(), [](const Term& t) {
    return std::all_of(t.factors.begin(), t.factors.end(), [](const Factor& f) {
      return f.exponent.get_den() == 1 && mpz_even_p(f.exponent.get_num_mpz_t()) != 0;
    });
  });
  if (squares < 2) return {};
  const auto form = rational_form(*this, base, Factoring::both);
  if (!form || form->coefficient != 1) return {};
  Term whole{1, {}};
  for (const auto& [factor, power] : form->powers) {
    if (power % 2 != 0) return {};
    multiply(whole, absolute(factor), power * exponent);
  }
  return product(std::move(whole));
}

SumId Simplifier::rewritten_sum(SumId s) {
  if (const auto it = rewritten_.find(s); it != rewritten_.end()) return it->second;
  SumId best = by_sum_rules(s);
  while (sum(best).size() <= searched_terms && work_ < work_limit) {
    poll_interrupt();
    std::vector<SumId> candidates;
    expanded(best, candidates);
    grouped(best, candidates);
    if (const auto whole = over_common_denominator(best)) candidates.push_back(*whole);
    if (const auto product = in_factors(best)) candidates.push_back(*product);
    const std::vector<SumId> written(
        candidates.begin(), candidates.begin() + std::min<std::ptrdiff_t>(2, std::ssize(candidates)));
    for (SumId c : written)
      for (SumId related : with_related_arguments(c)) {
        candidates.push_back(related);
        expanded(related, candidates);
      }
    for (SumId related : with_related_arguments(best)) {
      candidates.push_back(related);
      expanded(related, candidates);
    }
    SumId shortest = best;
    for (SumId c : candidates)
      if (const SumId after = by_sum_rules(c); traits(after).tokens < traits(shortest).tokens)
        shortest = after;
    if (shortest == best) break;
    best = shortest;
  }
  return rewritten_[s] = best;
}

}  // namespace pendula
