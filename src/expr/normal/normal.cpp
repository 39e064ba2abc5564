#include "expr/normal/normal.hpp"

#include <algorithm>
#include <cmath>

namespace pendula {
namespace {

constexpr long power_limit = 64;  // (2x)^n is written 2^n x^n up to this n: 2⁶⁴ has 20 digits

// Of primes: the root of their multiples is not reduced.
constexpr unsigned long small_squares[] = {4, 9, 25, 49};

std::size_t combine(std::size_t seed, std::size_t value) {
  return seed ^ (value + 0x9e3779b97f4a7c15ull + (seed << 6) + (seed >> 2));
}

std::size_t hash_number(double value) { return std::hash<double>()(value); }

/// Cost of cos(asin x), equal to that of √(1 - x²), and of cos(2 atan x), equal to that of (1 - x²)/(1 + x²).
constexpr double arc_tokens = 8;
bool is_arc(const Atom& a) {
  constexpr Op arcs[] = {Op::asin, Op::acos, Op::atan, Op::asinh, Op::acosh, Op::atanh};
  return a.kind == AtomKind::function && std::find(std::begin(arcs), std::end(arcs), a.op) != std::end(arcs);
}

std::size_t hash_of(const Sum& terms) {
  std::size_t h = terms.size();
  for (const Term& t : terms) {
    h = combine(h, hash_number(t.coefficient.value()));
    for (const Factor& f : t.factors) h = combine(combine(h, f.atom), hash_number(f.exponent.get_d()));
  }
  return h;
}

std::size_t hash_of(const Atom& a) {
  std::size_t h =
      combine(static_cast<std::size_t>(a.kind) * 64 + static_cast<std::size_t>(a.op), a.node.id());
  for (SumId s : a.args) h = combine(h, s);
  return h;
}

bool factors_less(const std::vector<Factor>& a, const std::vector<Factor>& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                      [](const Factor& x, const Factor& y) {
                                        return x.atom != y.atom ? x.atom < y.atom : x.exponent < y.exponent;
                                      });
}

}  // namespace

// ── numbers ────────────────────────────────────────────────────────────────────────────────────────────────

Number Number::approximate(double value) {
  if (const auto q = simplest_rational(value)) return Number(*q);
  Number n;
  n.value_ = value;
  n.is_exact_ = false;
  return n;
}

Number Number::of(Expr constant) {
  const mpq_class* q = exact_value(constant);
  return q ? Number(*q) : approximate(constant_value(constant));
}

Number operator+(const Number& a, const Number& b) {
  if (a.is_exact_ && b.is_exact_) return Number(mpq_class(a.exact_ + b.exact_));
  return Number::approximate(a.value_ + b.value_);
}

Number operator*(const Number& a, const Number& b) {
  if (a.is_exact_ && b.is_exact_) return Number(mpq_class(a.exact_ * b.exact_));
  return a.is(0) || b.is(0) ? Number(0) : Number::approximate(a.value_ * b.value_);
}

std::optional<Number> Number::power(const Number& a, const mpz_class& n) {
  if (a.is(1)) return a;
  if (a.is(-1)) return Number(mpz_odd_p(n.get_mpz_t()) ? -1 : 1);
  if (abs(n) > power_limit || (a.sign() == 0 && n <= 0)) return {};
  if (!a.is_exact_) {
    const double value = std::pow(a.value_, n.get_d());
    return std::isfinite(value) && value != 0 ? std::optional(approximate(value)) : std::nullopt;
  }
  mpz_class num, den;
  const auto k = static_cast<unsigned long>(std::labs(n.get_si()));
  mpz_pow_ui(num.get_mpz_t(), a.exact_.get_num_mpz_t(), k);
  mpz_pow_ui(den.get_mpz_t(), a.exact_.get_den_mpz_t(), k);
  mpq_class q = n >= 0 ? mpq_class(num, den) : mpq_class(den, num);
  q.canonicalize();
  if (mpz_sizeinbase(q.get_num_mpz_t(), 2) + mpz_sizeinbase(q.get_den_mpz_t(), 2) > weight_bits) return {};
  return Number(q);
}

// ── interning ──────────────────────────────────────────────────────────────────────────────────────────────

void Traits::include(const Traits& part) {
  if (part.level >= level) degree = part.level > level ? part.degree : std::max(degree, part.degree);
  order = std::max(order, part.order);
  level = std::max(level, part.level);
  depth = std::max(depth, part.depth);
  tokens = std::min(tokens + part.tokens, 1e300);  // shared parts count each time: stays finite
}

void NormalForms::collect(Term& term) const {
  std::sort(term.factors.begin(), term.factors.end(),
            [](const Factor& a, const Factor& b) { return a.atom < b.atom; });
  std::vector<Factor> merged;
  for (Factor& f : term.factors) {
    if (!merged.empty() && merged.back().atom == f.atom) {
      merged.back().exponent += f.exponent;
    } else {
      merged.push_back(std::move(f));
    }
  }
  std::erase_if(merged, [](const Factor& f) { return f.exponent == 0; });
  term.factors = std::move(merged);
}

/// Additional cost of unusual forms: √2/2 is preferred to 1/√2 and √(1/2), 2 √2 to √8, a b/(a + b) to
/// 1/(1/a + 1/b).
double NormalForms::irregular_tokens(const Factor& f) const {
  const Atom& a = atoms_[f.atom];
  if (a.kind != AtomKind::sum) return 0;
  const Sum& inside = sum(a.args[0]);
  if (f.exponent < 0 && f.exponent.get_den() == 1)
    return 2 * static_cast<double>(std::count_if(inside.begin(), inside.end(), [](const Term& t) {
             return std::any_of(t.factors.begin(), t.factors.end(),
                                [](const Factor& g) { return g.exponent < 0; });
           }));
  if (f.exponent.get_den() == 1 || a.traits.level >= 0) return 0;
  if (f.exponent < 0) return 1;
  if (inside.size() != 1 || !inside[0].factors.empty() || !inside[0].coefficient.exact()) return 0;
  const mpq_class& q = inside[0].coefficient.rational();
  return q.get_den() != 1 ||
         std::any_of(std::begin(small_squares), std::end(small_squares),
                     [&](unsigned long n) { return mpz_divisible_ui_p(q.get_num_mpz_t(), n) != 0; });
}

Traits NormalForms::traits_of(const Term& term) const {
  Traits t;
  t.tokens = !term.coefficient.is(1) && !term.coefficient.is(-1);
  double degree = 0;
  for (const Factor& f : term.factors) {
    const Traits& part = atoms_[f.atom].traits;
    if (part.level > t.level) degree = 0;
    if (part.level >= t.level) degree += f.exponent.get_d() * part.degree;
    t.include(part);
    t.tokens += f.exponent != 1 && f.exponent != -1;
    t.tokens += irregular_tokens(f);
  }
  t.tokens = std::max(t.tokens, 1.0);
  t.degree = degree;
  return t;
}

SumId NormalForms::intern(Sum terms) {
  std::sort(terms.begin(), terms.end(),
            [](const Term& a, const Term& b) { return factors_less(a.factors, b.factors); });
  Sum merged;
  merged.reserve(terms.size());
  for (Term& t : terms) {
    if (!merged.empty() && merged.back().factors == t.factors) {
      merged.back().coefficient = merged.back().coefficient + t.coefficient;
    } else {
      merged.push_back(std::move(t));
    }
  }
  std::erase_if(merged, [](const Term& t) { return t.coefficient.sign() == 0; });
  const std::size_t h = hash_of(merged);
  const auto [first, last] = sum_table_.equal_range(h);
  for (auto it = first; it != last; ++it)
    if (sum(it->second) == merged) return it->second;
  Traits traits;
  for (const Term& t : merged) traits.include(traits_of(t));
  traits.tokens += merged.empty() ? 1 : static_cast<double>(merged.size() - 1);
  storage_.push_back(std::make_unique<Sum>(std::move(merged)));
  sums_.push_back({storage_.back().get(), traits});
  const auto id = static_cast<SumId>(sums_.size() - 1);
  sum_table_.emplace(h, id);
  return id;
}

AtomId NormalForms::intern(Atom a) {
  const std::size_t h = hash_of(a);
  const auto [first, last] = atom_table_.equal_range(h);
  for (auto it = first; it != last; ++it) {
    const Atom& there = atoms_[it->second];
    if (there.kind == a.kind && there.op == a.op && there.node == a.node && there.args == a.args)
      return it->second;
  }
  for (SumId s : a.args) a.traits.include(traits(s));
  if (a.kind != AtomKind::sum) a.traits.degree = a.kind == AtomKind::leaf ? 1 : 0;
  a.traits.depth += 1;
  a.traits.tokens += a.kind == AtomKind::sum ? 0 : is_arc(a) ? arc_tokens : 1;
  atoms_.push_back(std::move(a));
  const auto id = static_cast<AtomId>(atoms_.size() - 1);
  atom_table_.emplace(h, id);
  return id;
}

AtomId NormalForms::leaf_atom(Expr leaf) {
  Atom a{AtomKind::leaf, Op::symbol, leaf, {}, {}};
  const Symbol& s = symbol_of(leaf);
  a.traits.order = s.order;
  const bool moves = s.kind == Kind::variable || s.kind == Kind::slot;
  a.traits.level = moves ? 2 : s.kind == Kind::input || s.kind == Kind::time ? 1 : 0;
  return intern(std::move(a));
}

AtomId NormalForms::sum_atom(SumId s) { return intern(Atom{AtomKind::sum, Op::add, {}, {s}, {}}); }

AtomId NormalForms::function_atom(Op op, std::vector<SumId> args) {
  return intern(Atom{AtomKind::function, op, {}, std::move(args), {}});
}

AtomId NormalForms::power_atom(SumId base, SumId exponent) {
  return intern(Atom{AtomKind::power, Op::pow, {}, {base, exponent}, {}});
}

// ── products ───────────────────────────────────────────────────────────────────────────────────────────────

Number NormalForms::content(const Sum& terms) const {
  mpz_class num = 0, den = 1;
  for (const Term& t : terms) {
    if (!t.coefficient.exact()) return 1;
    const mpq_class& q = t.coefficient.rational();
    if (q.get_den() > simple_denominator) return 1;
    num = gcd(num, q.get_num());
    den = lcm(den, q.get_den());
  }
  mpq_class c(num, den);
  c.canonicalize();
  return Number(c);
}

SumId NormalForms::scaled(SumId s, const Number& by) {
  if (by.is(1)) return s;
  Sum terms = sum(s);
  for (Term& t : terms) t.coefficient = t.coefficient * by;
  return intern(std::move(terms));
}

Number NormalForms::take_content(Sum& terms) const {
  const Number c = content(terms);
  if (!c.is(1))
    for (Term& t : terms) t.coefficient = t.coefficient * *Number::power(c, -1);
  return c;
}

/// Replaces ±(a + b) by its terms; extraction of 1/2 from x + (a + b)/2 leaves such a sum.
static Sum flattened(const NormalForms& forms, Sum terms) {
  constexpr std::size_t most = 64;  // terms: a choice, longer sums are not copied
  Sum flat;
  for (Term& t : terms) {
    const bool unit = t.coefficient.is(1) || t.coefficient.is(-1);
    const bool alone = unit && t.factors.size() == 1 && t.factors[0].exponent == 1 &&
                       forms.atom(t.factors[0].atom).kind == AtomKind::sum;
    const Sum* inside = alone ? &forms.sum(forms.atom(t.factors[0].atom).args[0]) : nullptr;
    if (!inside || inside->size() > most) {
      flat.push_back(std::move(t));
      continue;
    }
    for (const Term& part : *inside) flat.push_back({t.coefficient * part.coefficient, part.factors});
  }
  return flat;
}

void NormalForms::multiply(Term& term, SumId base, const mpq_class& exponent) {
  if (exponent.get_den() != 1) return multiply_root(term, base, exponent);
  const Sum& terms = sum(base);
  const mpz_class& n = exponent.get_num();
  if (terms.empty()) {
    term.coefficient = n > 0 ? Number(0) : term.coefficient;
    if (n < 0) term.factors.push_back({sum_atom(base), exponent});
  } else if (terms.size() == 1) {
    const auto c = Number::power(terms[0].coefficient, n);
    if (c) {
      term.coefficient = term.coefficient * *c;
      for (const Factor& f : terms[0].factors) term.factors.push_back({f.atom, f.exponent * exponent});
    } else {
      term.factors.push_back({sum_atom(base), exponent});
    }
  } else {
    Sum rest = terms;
    const Term common = take_common(rest);
    const auto c = Number::power(common.coefficient, n);
    if (!c) {
      term.factors.push_back({sum_atom(base), exponent});
      return;
    }
    term.coefficient = term.coefficient * *c;
    for (const Factor& f : common.factors) term.factors.push_back({f.atom, f.exponent * exponent});
    term.factors.push_back({sum_atom(intern(flattened(*this, std::move(rest)))), exponent});
  }
}

void NormalForms::multiply_root(Term& term, SumId base, const mpq_class& exponent) {
  const Sum& terms = sum(base);
  const bool atom = terms.size() == 1 && terms[0].coefficient.is(1) && terms[0].factors.size() == 1 &&
                    terms[0].factors[0].exponent == 1;
  term.factors.push_back({atom ? terms[0].factors[0].atom : sum_atom(base), exponent});
}

SumId NormalForms::function(Op op, std::vector<SumId> args) {
  if (op != Op::sqrt) return single(function_atom(op, std::move(args)));
  if (sum(args[0]).empty()) return args[0];
  Term root{1, {}};
  multiply(root, args[0], mpq_class(1, 2));
  return product(std::move(root));
}

void NormalForms::settle(Term& term) {
  collect(term);
  const auto dissolves = [&](const Factor& f) {
    const Atom& a = atom(f.atom);
    return a.kind == AtomKind::sum && f.exponent.get_den() == 1 && sum(a.args[0]).size() == 1;
  };
  for (auto it = term.factors.begin(); it != term.factors.end(); ++it) {
    if (!dissolves(*it)) continue;
    const Factor f = *it;
    const std::size_t before = term.factors.size();
    term.factors.erase(it);
    multiply(term, atom(f.atom).args[0], f.exponent);
    if (term.factors.size() == before && term.factors.back() == f) return collect(term);  // too large
    return settle(term);
  }
}

bool NormalForms::multiplies_out(const Factor& f) const {
  return atoms_[f.atom].kind == AtomKind::sum && f.exponent >= 1 && f.exponent.get_den() == 1;
}

bool NormalForms::multiplies_out(const Term& t) const {
  return std::any_of(t.factors.begin(), t.factors.end(), [&](const Factor& f) { return multiplies_out(f); });
}

Term NormalForms::times(const Term& a, const Term& b) {
  Term product{a.coefficient * b.coefficient, {}};
  product.factors.reserve(a.factors.size() + b.factors.size());
  auto x = a.factors.begin(), y = b.factors.begin();
  while (x != a.factors.end() || y != b.factors.end()) {
    if (y == b.factors.end() || (x != a.factors.end() && x->atom < y->atom)) {
      product.factors.push_back(*x++);
    } else if (x == a.factors.end() || y->atom < x->atom) {
      product.factors.push_back(*y++);
    } else {
      product.factors.push_back({x->atom, x->exponent + y->exponent});
      if (product.factors.back().exponent == 0) product.factors.pop_back();
      ++x;
      ++y;
    }
  }
  if (std::any_of(product.factors.begin(), product.factors.end(),
                  [&](const Factor& f) { return atoms_[f.atom].kind == AtomKind::sum; }))
    settle(product);
  return product;
}

SumId NormalForms::product(Term term) {
  settle(term);
  return term.coefficient.sign() == 0 ? intern(Sum{}) : rewritten_product(std::move(term));
}

SumId NormalForms::finished_product(Term term) {
  const bool unit = term.coefficient.is(1) || term.coefficient.is(-1);
  if (unit && term.factors.size() == 1 && term.factors[0].exponent == 1) {
    const Atom& a = atom(term.factors[0].atom);
    if (a.kind == AtomKind::sum && copied_ < copy_limit) {
      copied_ += static_cast<double>(sum(a.args[0]).size());
      return scaled(a.args[0], term.coefficient);
    }
  }
  return intern(Sum{std::move(term)});
}

}  // namespace pendula
