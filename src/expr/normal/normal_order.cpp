// Textbook order of terms and factors, and the conversion of a form to an expression. The order depends on
// structure and on the order of declaration of the symbols, never on the ids of operations.
#include <numeric>

#include "base/interrupt.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/normal/normal.hpp"

namespace pendula {
namespace {

// Choices: readers see no order in deeper or longer sums.
constexpr std::size_t compared_terms = 64;
constexpr int compared_depth = 60;  // deeper differences are decided by the order of creation of the forms

template <class T>
int three_way(const T& a, const T& b) {
  return a < b ? -1 : b < a ? 1 : 0;
}

int compare_names(Expr a, Expr b) {
  const Symbol &s = symbol_of(a), &t = symbol_of(b);
  if (s.base != t.base) return three_way(declaration_of(a), declaration_of(b));
  return three_way(s.order, t.order);
}

/// The leaves of the given level, highest derivative first, then by declaration.
std::vector<Factor> leaves_of(const NormalForms& forms, const Term& term, int level) {
  std::vector<Factor> found;
  for (const Factor& f : term.factors) {
    const Atom& a = forms.atom(f.atom);
    if (a.kind == AtomKind::leaf && a.traits.level == level) found.push_back(f);
  }
  std::sort(found.begin(), found.end(), [&](const Factor& x, const Factor& y) {
    const Atom &a = forms.atom(x.atom), &b = forms.atom(y.atom);
    if (a.traits.order != b.traits.order) return a.traits.order > b.traits.order;
    return compare_names(a.node, b.node) < 0;
  });
  return found;
}

int compare_leaves(const NormalForms& forms, const std::vector<Factor>& a, const std::vector<Factor>& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const Atom &x = forms.atom(a[i].atom), &y = forms.atom(b[i].atom);
    if (x.traits.order != y.traits.order) return three_way(y.traits.order, x.traits.order);
    if (const int names = compare_names(x.node, y.node)) return names;
    if (a[i].exponent != b[i].exponent) return three_way(b[i].exponent, a[i].exponent);
  }
  return three_way(b.size(), a.size());
}

}  // namespace

int NormalForms::compare(AtomId a, AtomId b, int depth) const {
  if (a == b) return 0;
  const Atom &x = atoms_[a], &y = atoms_[b];
  if (x.kind != y.kind) return three_way(x.kind, y.kind);
  if (depth > compared_depth) return three_way(a, b);
  if (x.kind == AtomKind::leaf) return compare_names(x.node, y.node);
  if (x.op != y.op) return three_way(x.op, y.op);
  if (x.kind == AtomKind::call) {
    const FunctionCall &f = call_of(x.node), &g = call_of(y.node);
    if (f.name != g.name) return three_way(f.name, g.name);
    if (f.partial != g.partial) return three_way(g.partial, f.partial);
  }
  if (x.args.size() != y.args.size()) return three_way(x.args.size(), y.args.size());
  for (std::size_t i = 0; i < x.args.size(); ++i)
    if (const int c = compare_sums(x.args[i], y.args[i], depth + 1)) return c;
  return three_way(a, b);
}

int NormalForms::compare_sums(SumId s, SumId t, int depth) const {
  poll_interrupt();  // sorting hundreds of thousands of deeply nested factors takes minutes
  if (s == t) return 0;
  if (sum(s).size() != sum(t).size()) return three_way(sum(s).size(), sum(t).size());
  if (sum(s).size() > compared_terms) return three_way(s, t);
  const std::vector<std::uint32_t>&order_s = order_of(s), &order_t = order_of(t);
  for (std::size_t i = 0; i < order_s.size(); ++i) {
    const Term &a = sum(s)[order_s[i]], &b = sum(t)[order_t[i]];
    if (a.factors.size() != b.factors.size()) return three_way(a.factors.size(), b.factors.size());
    const auto f = ordered_factors(a), g = ordered_factors(b);
    for (std::size_t k = 0; k < f.size(); ++k) {
      if (const int c = compare(f[k].atom, g[k].atom, depth + 1)) return c;
      if (f[k].exponent != g[k].exponent) return three_way(g[k].exponent, f[k].exponent);
    }
    if (a.coefficient.value() != b.coefficient.value())
      return three_way(b.coefficient.value(), a.coefficient.value());
  }
  return three_way(s, t);
}

int NormalForms::factor_rank(const Factor& f) const {
  const Atom& a = atoms_[f.atom];
  switch (a.kind) {
    case AtomKind::leaf:
      if (symbol_of(a.node).kind == Kind::constant) return 0;
      return a.traits.level == 0 ? 1 : a.traits.level == 1 ? 3 : 4;
    case AtomKind::sum:
      return a.traits.level <= 0 ? 2 : 6;
    case AtomKind::power:
      return 7;
    case AtomKind::opaque:
      return 7;
    case AtomKind::function:
      return a.op == Op::abs ? 7 : 8;
    default:
      return 8;
  }
}

bool NormalForms::factor_before(const Factor& x, const Factor& y) const {
  const int rx = factor_rank(x), ry = factor_rank(y);
  if (rx != ry) return rx < ry;
  const Atom &a = atoms_[x.atom], &b = atoms_[y.atom];
  if (a.kind == AtomKind::leaf && a.traits.order != b.traits.order) return a.traits.order < b.traits.order;
  return compare(x.atom, y.atom) < 0;
}

std::vector<Factor> NormalForms::ordered_factors(const Term& term) const {
  std::vector<Factor> factors = term.factors;
  std::sort(factors.begin(), factors.end(),
            [&](const Factor& a, const Factor& b) { return factor_before(a, b); });
  return factors;
}

TermKey NormalForms::key(const Term& t) const {
  TermKey k{traits_of(t), {}};
  for (int level = 0; level <= 2; ++level) k.leaves[level] = leaves_of(*this, t, level);
  return k;
}

bool NormalForms::term_before(const Term& s, const TermKey& ks, const Term& t, const TermKey& kt) const {
  if (ks.traits.order != kt.traits.order) return ks.traits.order > kt.traits.order;
  if (ks.traits.level != kt.traits.level) return ks.traits.level > kt.traits.level;
  if (ks.traits.degree != kt.traits.degree) return ks.traits.degree > kt.traits.degree;
  for (int level = 2; level >= 0; --level)
    if (const int c = compare_leaves(*this, ks.leaves[level], kt.leaves[level])) return c < 0;
  if (s.factors.size() != t.factors.size()) return s.factors.size() < t.factors.size();
  const auto f = ordered_factors(s), g = ordered_factors(t);
  for (std::size_t k = 0; k < f.size(); ++k) {
    if (const int c = compare(f[k].atom, g[k].atom)) return c < 0;
    if (f[k].exponent != g[k].exponent) return f[k].exponent > g[k].exponent;
  }
  return false;
}

/// All sums inside `root`, operands first.
std::vector<SumId> NormalForms::below(SumId root, const std::function<bool(SumId)>& skip) const {
  std::vector<SumId> stack{root}, found;
  std::unordered_map<SumId, bool> seen{{root, true}};
  while (!stack.empty()) {
    const SumId id = stack.back();
    stack.pop_back();
    if (skip(id)) continue;
    found.push_back(id);
    for (const Term& t : sum(id))
      for (const Factor& f : t.factors)
        for (SumId part : atoms_[f.atom].args)
          if (seen.try_emplace(part, true).second) stack.push_back(part);
  }
  std::sort(found.begin(), found.end());  // parts are interned before the sums that contain them
  return found;
}

const std::vector<std::uint32_t>& NormalForms::order_of(SumId root) const {
  if (const auto it = order_.find(root); it != order_.end()) return it->second;
  // Inner sums first, so that comparisons find their order ready and recursion stays shallow.
  for (SumId id : below(root, [&](SumId s) { return order_.contains(s); })) {
    const Sum& terms = sum(id);
    std::vector<std::uint32_t> order(terms.size());
    std::iota(order.begin(), order.end(), 0u);
    std::vector<TermKey> keys;
    if (terms.size() > 1)
      for (const Term& t : terms) keys.push_back(key(t));
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return term_before(terms[a], keys[a], terms[b], keys[b]);
    });
    order_[id] = std::move(order);
  }
  return order_.at(root);
}

std::vector<Term> NormalForms::ordered_terms(SumId id) const {
  std::vector<Term> result;
  result.reserve(sum(id).size());
  for (std::uint32_t i : order_of(id)) result.push_back(sum(id)[i]);
  return result;
}

// ── back to the graph ──────────────────────────────────────────────────────────────────────────────────────

Expr NormalForms::build(AtomId id, const mpq_class& exponent) const {
  const Atom& a = atoms_[id];
  Expr base;
  switch (a.kind) {
    case AtomKind::leaf:
    case AtomKind::opaque:
      base = a.node;
      break;
    case AtomKind::sum:
      base = built_.at(a.args[0]);
      break;
    case AtomKind::power:
      base = pow(built_.at(a.args[0]), built_.at(a.args[1]));
      break;
    case AtomKind::call: {
      FunctionCall application = call_of(a.node);
      for (std::size_t i = 0; i < a.args.size(); ++i) application.arguments[i] = built_.at(a.args[i]);
      base = call(application);
      break;
    }
    case AtomKind::function: {
      std::vector<Expr> x;
      for (SumId s : a.args) x.push_back(built_.at(s));
      x.resize(3);
      base = make(a.op, x[0], x[1], x[2]);
    }
  }
  return exponent == mpq_class(1, 2) ? sqrt(base) : pow(base, Expr(exponent));
}

/// Can -c (x - y) be written as c (y - x)?
bool NormalForms::turns(const Term& term) const {
  return std::any_of(term.factors.begin(), term.factors.end(), [&](const Factor& f) { return turns(f); });
}

bool NormalForms::turns(const Factor& f) const {
  if (atoms_[f.atom].kind != AtomKind::sum || f.exponent != 1) return false;
  const Sum& terms = sum(atoms_[f.atom].args[0]);
  return std::any_of(terms.begin(), terms.end(), [](const Term& t) { return t.coefficient.sign() < 0; });
}

Expr NormalForms::build_term(const Term& term, bool turned) const {
  const auto times = [](Expr a, Expr b) { return a.is_one() ? b : a * b; };
  Expr above = 1, below = 1;
  for (const Factor& f : ordered_factors(term)) {
    const bool turn = turned && turns(f);
    if (turn) turned = false;
    const Expr e = build(f.atom, abs(f.exponent));
    Expr& side = f.exponent > 0 ? above : below;
    side = times(side, turn ? -e : e);
  }
  const Number& c = term.coefficient;
  const Number size = c.sign() < 0 ? -c : c;
  const bool fraction =
      size.exact() && size.rational().get_den() != 1 && size.rational().get_den() <= simple_denominator;
  if (fraction) {
    above = times(Expr(mpq_class(size.rational().get_num())), above);
    below = times(Expr(mpq_class(size.rational().get_den())), below);
  } else {
    above = times(size.expr(), above);
  }
  return above / below;
}

Expr NormalForms::build(SumId root) {
  for (SumId id : below(root, [&](SumId s) { return built_.contains(s); })) {
    Expr result = 0;
    bool first = true;
    for (const Term& t : ordered_terms(id)) {
      const bool minus = t.coefficient.sign() < 0, turned = minus && sum(id).size() == 1 && turns(t);
      const Expr e = build_term(t, turned);
      result = minus && !turned ? (first ? -e : result - e) : (first ? e : result + e);
      first = false;
    }
    built_[id] = result;
  }
  return built_.at(root);
}

}  // namespace pendula
