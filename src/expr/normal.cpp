#include "expr/normal.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula {
namespace {

constexpr double copy_limit = 4e6;         // terms that one session may copy out of shared sums
constexpr std::size_t weight_bits = 4096;  // coefficients and exponents beyond this keep their node whole
constexpr long power_limit = 64;           // (2x)^n is written 2^n x^n up to this n
constexpr long simple_denominator = 20;    // 9.81 is not a multiple of 1/100 to a reader

std::size_t combine(std::size_t seed, std::size_t value) {
  return seed ^ (value + 0x9e3779b97f4a7c15ull + (seed << 6) + (seed >> 2));
}

std::size_t hash_number(double value) { return std::hash<double>()(value); }

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

/// n of x^n where n is a whole number that fits comfortably.
std::optional<long> whole_exponent(Expr power) {
  const mpq_class* n = exact_value(power.operand(1));
  if (!n || n->get_den() != 1 || !n->get_num().fits_slong_p() || abs(*n) > 1'000'000) return {};
  return n->get_num().get_si();
}

}  // namespace

// ── numbers
// ──────────────────────────────────────────────────────────────────────────────────────────────────────

Number Number::approximate(double value) {
  if (const auto q = simplest_rational(value)) return Number(*q);
  Number n;
  n.value_ = value, n.is_exact_ = false;
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

// ── interning
// ────────────────────────────────────────────────────────────────────────────────────────────────────

void Traits::include(const Traits& part) {
  if (part.level >= level) degree = part.level > level ? part.degree : std::max(degree, part.degree);
  order = std::max(order, part.order);
  level = std::max(level, part.level);
  depth = std::max(depth, part.depth);
  tokens = std::min(tokens + part.tokens, 1e300);
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

Traits NormalForms::traits_of(const Term& term) const {
  Traits t;
  t.tokens = 1;
  double degree = 0;
  for (const Factor& f : term.factors) {
    const Traits& part = atoms_[f.atom].traits;
    if (part.level > t.level) degree = 0;
    if (part.level >= t.level) degree += f.exponent.get_d() * part.degree;
    t.include(part);
  }
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
  a.traits.tokens += 1;
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

// ── products
// ─────────────────────────────────────────────────────────────────────────────────────────────────────

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

void NormalForms::multiply(Term& term, SumId base, const mpq_class& exponent) {
  const bool whole = exponent.get_den() == 1;
  const Sum& terms = sum(base);
  if (terms.empty() && exponent > 0) {
    term.coefficient = 0;
  } else if (terms.size() == 1) {
    const Term& t = terms[0];
    const auto c = whole ? Number::power(t.coefficient, exponent.get_num()) : std::nullopt;
    const bool atom = t.coefficient.is(1) && t.factors.size() == 1 && t.factors[0].exponent == 1;
    if (c || atom) {
      if (c) term.coefficient = term.coefficient * *c;
      for (const Factor& f : t.factors) term.factors.push_back({f.atom, f.exponent * exponent});
    } else {
      term.factors.push_back({sum_atom(base), exponent});
    }
  } else {
    Number c = whole ? content(terms) : Number(1);
    if (whole && fixed_sign_ && ordered_terms(base)[0].coefficient.sign() < 0) c = -c;
    const auto outside = Number::power(c, exponent.get_num());
    if (outside && !c.is(1)) {
      const Number inverse = *Number::power(c, -1);
      term.coefficient = term.coefficient * *outside;
      base = scaled(base, inverse);
    }
    term.factors.push_back({sum_atom(base), exponent});
  }
}

SumId NormalForms::product(Term term) {
  if (term.coefficient.sign() == 0) return intern(Sum{});
  collect(term);
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

// ── from the graph
// ───────────────────────────────────────────────────────────────────────────────────────────────

NormalForms::Role NormalForms::role(Expr e) {
  switch (e.op()) {
    case Op::neg:
    case Op::add:
    case Op::sub:
      return Role::sum;
    case Op::mul:
    case Op::div:
      return Role::product;
    case Op::pow:
      return whole_exponent(e) ? Role::product : Role::other;
    default:
      return Role::other;
  }
}

SumId NormalForms::form(Expr e) {
  const std::vector<Expr> order = topological({&e, 1});
  // A head needs a form of its own: the output, and every operand that does not continue the sum or product
  // above it.
  std::unordered_map<Expr, bool> head;
  head[e] = true;
  for (Expr node : order) {
    const Role r = role(node);
    for (Expr operand : node.operands())
      if (r == Role::other || role(operand) != r) head[operand] = true;
  }
  std::size_t count = 0;
  for (Expr node : order) {
    if (++count % 256 == 0) poll_interrupt();
    if (head.contains(node) && !memo_.contains(node)) {
      const SumId s = form_of_head(node);
      memo_[node] = s;
    }
  }
  return memo_[e];
}

SumId NormalForms::form_of_head(Expr e) {
  switch (role(e)) {
    case Role::sum:
      return form_of_sum(e);
    case Role::product:
      return form_of_product(e);
    default:
      return form_of_other(e);
  }
}

/// The nodes of the sum (product) that ends in `head`, operands first, up to nodes that have a form already.
std::vector<Expr> NormalForms::region(Expr head) const {
  const Role r = role(head);
  std::vector<Expr> order;
  std::unordered_map<Expr, bool> seen{{head, true}};
  std::vector<std::pair<Expr, std::size_t>> stack{{head, 0}};
  while (!stack.empty()) {
    auto& [e, entered] = stack.back();
    const auto operands = e.operands();
    if (entered == operands.size()) {
      order.push_back(e);
      stack.pop_back();
      continue;
    }
    const Expr operand = operands[entered++];
    if (inside(operand, r) && seen.try_emplace(operand, true).second) stack.push_back({operand, 0});
  }
  return order;
}

void NormalForms::append(Sum& terms, SumId part, const mpz_class& weight) {
  const Number w{mpq_class(weight)};
  const Sum& add = sum(part);
  copied_ += static_cast<double>(add.size());
  if (add.size() > 1 && copied_ > copy_limit) {
    terms.push_back({w, {{sum_atom(part), 1}}});
    return;
  }
  for (const Term& t : add) terms.push_back({t.coefficient * w, t.factors});
}

SumId NormalForms::form_of_sum(Expr e) {
  const std::vector<Expr> nodes = region(e);
  std::unordered_map<Expr, mpz_class> weight;
  Sum terms;
  weight[e] = 1;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const mpz_class w = weight[*it];
    const auto operands = it->operands();
    for (std::size_t i = 0; i < operands.size(); ++i) {
      const bool minus = it->op() == Op::neg || (it->op() == Op::sub && i == 1);
      const mpz_class wi = minus ? mpz_class(-w) : w;
      if (!inside(operands[i], Role::sum)) {
        append(terms, memo_.at(operands[i]), wi);
      } else if (mpz_sizeinbase(wi.get_mpz_t(), 2) > weight_bits) {
        terms.push_back(
            {Number(mpq_class(wi)), {{intern(Atom{AtomKind::opaque, Op::add, operands[i], {}, {}}), 1}}});
      } else {
        weight[operands[i]] += wi;
      }
    }
    weight.erase(*it);
  }
  return intern(std::move(terms));
}

SumId NormalForms::form_of_product(Expr e) {
  const std::vector<Expr> nodes = region(e);
  std::unordered_map<Expr, mpz_class> exponent;
  std::vector<std::pair<Expr, mpz_class>> bases;
  exponent[e] = 1;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const mpz_class n = exponent[*it];
    const auto operands = it->operands();
    for (std::size_t i = 0; i < operands.size(); ++i) {
      if (it->op() == Op::pow && i == 1) continue;
      const mpz_class ni = it->op() == Op::pow             ? mpz_class(n * *whole_exponent(*it))
                           : it->op() == Op::div && i == 1 ? mpz_class(-n)
                                                           : n;
      const bool longer = mpz_sizeinbase(ni.get_mpz_t(), 2) > weight_bits;
      if (inside(operands[i], Role::product) && !longer) {
        exponent[operands[i]] += ni;
      } else {
        bases.emplace_back(operands[i], ni);
      }
    }
    exponent.erase(*it);
  }
  Term term{1, {}};
  for (const auto& [base, n] : bases) {
    const auto it = memo_.find(base);
    const bool undefined =
        it != memo_.end() && sum(it->second).empty() && n < 0;  // 1/(x - x): leave it alone
    if (it == memo_.end() || undefined) {
      term.factors.push_back({intern(Atom{AtomKind::opaque, Op::mul, base, {}, {}}), mpq_class(n)});
    } else {
      multiply(term, it->second, mpq_class(n));
    }
  }
  return product(std::move(term));
}

SumId NormalForms::form_of_other(Expr e) {
  if (e.is_constant()) return number(Number::of(e));
  if (e.is_symbol()) return single(leaf_atom(e));
  std::vector<SumId> args;
  for (Expr operand : e.operands()) args.push_back(memo_.at(operand));
  if (e.op() == Op::call) return single(intern(Atom{AtomKind::call, Op::call, e, std::move(args), {}}));
  if (e.op() != Op::pow) return single(function_atom(e.op(), std::move(args)));
  if (const mpq_class* q = exact_value(e.operand(1)); q && !sum(args[0]).empty()) {
    Term term{1, {}};
    multiply(term, args[0], *q);
    return product(std::move(term));
  }
  return single(power_atom(args[0], args[1]));
}

}  // namespace pendula
