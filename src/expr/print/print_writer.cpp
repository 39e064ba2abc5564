#include "expr/print/print_writer.hpp"

#include "base/counted.hpp"
#include "base/error.hpp"
#include "expr/graph/solve.hpp"

namespace pendula {
namespace {

// (a + b + c + d + e)²⁰, 10626 terms, prints in 0.2 s; `deepest` bounds the stack.
constexpr double longest = 250'000;  // pieces
constexpr int deepest = 150;
// In expressions that are too long or deep, parts beyond this nesting or number of pieces are elided.
// Choices: what is left fills a screen. A sum of more than 20 terms shows the first 12.
constexpr int shown_nesting = 8;
constexpr std::size_t shown_pieces = 400;
constexpr double small_part = 60;
constexpr std::size_t long_sum = 20, shown_terms = 12;

/// Moves a positive term to the front of a sum that starts with a minus; -x² - x + 1 keeps its order.
void positive_first(const NormalForms& forms, std::vector<Item>& list) {
  if (list.size() < 2 || list[0].term.coefficient.sign() > 0) return;
  const Traits first = forms.traits_of(list[0].whole);
  for (std::size_t i = 1; i < list.size(); ++i) {
    const Traits t = forms.traits_of(list[i].whole);
    if (list[i].term.coefficient.sign() < 0) continue;
    if (list.size() > 2 && first.order == 0 && t.level != first.level) continue;
    std::rotate(list.begin(), list.begin() + static_cast<long>(i), list.begin() + static_cast<long>(i) + 1);
    return;
  }
}

/// Order of vector sums: accelerations and velocities, then constants, then the rest;
/// otherwise textbook order.
int vector_rank(const NormalForms& forms, const Item& item) {
  if (!item.written.empty()) return 3;
  if (item.unit > 0) return 1;
  return forms.traits_of(item.whole).order > 0 ? 0 : 2;
}

}  // namespace

void Writer::decide(const Traits& traits) { eliding_ = traits.tokens > longest || traits.depth > deepest; }

std::string Writer::whole(SumId id) {
  decide(forms_.traits(id));
  return sum(id).text;
}

std::string Writer::whole(const std::vector<SumId>& entries) {
  Traits all;
  for (SumId e : entries) all.include(forms_.traits(e));
  decide(all);
  return column(entries, true).text;
}

Piece Writer::sum(SumId id) {
  const Sum& terms = forms_.sum(id);
  if (terms.empty()) return {"0", Bind::atom};
  if (eliding_ && terms.size() > long_sum) {
    std::vector<Item> list;
    for (const Term& t : forms_.ordered_terms(id)) {
      if (list.size() == shown_terms) break;
      list.push_back({t, t, {}, 0, {}});
    }
    return items(std::move(list), terms.size() - shown_terms);
  }
  return items(finder_.items(id));
}

Piece Writer::items(std::vector<Item> list, std::size_t left_out) {
  positive_first(forms_, list);
  if (list.size() == 1 && left_out == 0 && list[0].term.coefficient.sign() > 0) return item(list[0]);
  std::string text;
  for (const Item& i : list) {
    const bool minus = i.term.coefficient.sign() < 0;
    text += text.empty() ? (minus ? "-" : "") : minus ? " - " : " + ";
    text += notation_.within(item(i), Bind::product);
  }
  if (left_out > 0) text += " + " + notation_.elided(pendula::text(left_out, " more terms")).text;
  return {text, Bind::sum};
}

Piece Writer::item(const Item& item) {
  std::vector<Piece> above, below;
  std::vector<Factor> functions;
  const auto put = [&](const Factor& f) {
    (f.exponent > 0 ? above : below).push_back(factor(f.atom, abs(f.exponent)));
  };
  for (const Factor& f : forms_.ordered_factors(item.term)) {
    if (!item.vectors.empty() && forms_.factor_rank(f) >= 6) {
      functions.push_back(f);
    } else {
      put(f);
    }
  }
  if (item.vectors.size() == 2) {
    const Component &x = item.vectors[0][0].column, &y = item.vectors[1][0].column;
    const bool swapped = y.order < x.order;
    above.push_back(notation_.dot(lift(item.vectors[swapped]), lift(item.vectors[!swapped])));
  }
  for (const Factor& f : functions) put(f);
  if (item.vectors.size() == 1) above.push_back(lift(item.vectors[0]));
  if (item.unit > 0) above.push_back(notation_.unit_vector(item.unit));
  if (!item.written.empty()) above.push_back(column(item.written, false));
  const Number& c = item.term.coefficient;
  written_ += above.size() + below.size();
  return notation_.product(c.sign() < 0 ? -c : c, std::move(above), std::move(below));
}

Piece Writer::lift(const Lift& l) {
  std::string text;
  // columns come last in their terms; the first positive one leads
  std::size_t lead = 0;
  while (lead < l.size() && l[lead].scalar.coefficient.sign() < 0) ++lead;
  if (lead == l.size()) lead = 0;
  const auto write = [&](const LiftedTerm& t) {
    const Piece column = notation_.column(t.column.name, t.column.order);
    const bool minus = t.scalar.coefficient.sign() < 0;
    std::vector<Piece> above, below;
    for (const Factor& f : forms_.ordered_factors(t.scalar))
      (f.exponent > 0 ? above : below).push_back(factor(f.atom, abs(f.exponent)));
    above.push_back(column);
    const Number& c = t.scalar.coefficient;
    const Piece p = notation_.product(minus ? -c : c, std::move(above), std::move(below));
    if (l.size() == 1 && !minus) return p;
    text += text.empty() ? (minus ? "-" : "") : minus ? " - " : " + ";
    text += p.text;
    return Piece{text, Bind::sum};
  };
  Piece result = write(l[lead]);
  for (std::size_t i = 0; i < l.size(); ++i)
    if (i != lead) result = write(l[i]);
  return result;
}

Piece Writer::factor(AtomId id, const mpq_class& exponent) {
  if (exponent.get_den() == 2 && exponent.get_num() == 1) {
    const Atom a = forms_.atom(id);
    if (a.kind != AtomKind::sum) return notation_.root(atom(id));
    const auto n = norm(a.args[0]);
    return n ? *n : notation_.root(atom(id));
  }
  return notation_.power(atom(id), exponent);
}

Piece Writer::atom(AtomId id) {
  const Atom a = forms_.atom(id);
  if (a.kind == AtomKind::leaf) return notation_.symbol(symbol_of(a.node));
  if (a.op == Op::solve) return notation_.solution(component_of(a.node) + 1);
  const bool hidden = eliding_ && ((nesting_ > shown_nesting && a.traits.tokens > small_part) ||
                                   (written_ > shown_pieces && a.traits.tokens > 3));
  if (hidden || a.kind == AtomKind::opaque)
    return notation_.elided(text(counted(operations(a), "operation")));
  ++nesting_;
  Piece p;
  switch (a.kind) {
    case AtomKind::sum:
      p = sum(a.args[0]);
      break;
    case AtomKind::power:
      p = notation_.power(sum(a.args[0]), sum(a.args[1]));
      break;
    case AtomKind::call:
      p = call(a);
      break;
    default:
      p = function(a);
  }
  --nesting_;
  return p;
}

Piece Writer::function(const Atom& a) {
  if (a.op == Op::abs) return notation_.absolute(sum(a.args[0]));
  std::vector<Piece> args;
  for (SumId s : a.args) args.push_back(sum(s));
  return notation_.function(a.op, args);
}

/// √(aᵀa) is ‖a‖.
std::optional<Piece> Writer::norm(SumId argument) {
  const auto list = finder_.items(argument);
  if (list.size() != 1 || list[0].vectors.size() != 2 || !(list[0].term == Term{1, {}})) return {};
  const Piece a = lift(list[0].vectors[0]), b = lift(list[0].vectors[1]);
  if (a.text != b.text) return {};
  return notation_.norm(a);
}

// ── unspecified functions ──────────────────────────────────────────────────────────────────────────────────

std::optional<Piece> Writer::plain_symbol(SumId id) {
  const Sum& s = forms_.sum(id);
  if (s.size() != 1 || !s[0].coefficient.is(1) || s[0].factors.size() != 1 || s[0].factors[0].exponent != 1)
    return {};
  const Atom& a = forms_.atom(s[0].factors[0].atom);
  if (a.kind != AtomKind::leaf) return {};
  return notation_.symbol(symbol_of(a.node));
}

Piece Writer::argument(const std::vector<SumId>& group) {
  return group.size() == 1 ? sum(group[0]) : column(group, true);
}

Piece Writer::call(const Atom& a) {
  const FunctionCall f = call_of(a.node);
  std::vector<Piece> args;
  auto next = a.args.begin();
  for (int size : f.groups) {
    args.push_back(argument({next, next + size}));
    next += size;
  }
  std::vector<Piece> wrt;
  std::vector<int> places;
  bool plain = true;
  for (std::size_t i = 0; i < f.partial.size(); ++i) {
    const auto symbol = plain_symbol(a.args[i]);
    plain = plain && symbol;
    for (int k = 0; k < f.partial[i]; ++k) {
      places.push_back(static_cast<int>(i) + 1);
      if (symbol) wrt.push_back(*symbol);
    }
  }
  if (places.empty()) return notation_.call(f.name, args);
  return plain ? notation_.partial(f.name, wrt) : notation_.partial_at(f.name, places, args);
}

// ── columns ────────────────────────────────────────────────────────────────────────────────────────────────

Piece Writer::column(const std::vector<SumId>& entries, bool by_names) {
  if (by_names) {
    auto list = finder_.items(entries);
    const bool partly = list && !list->back().written.empty();
    if (!list || partly)
      if (auto blocks = in_blocks(entries)) return *blocks;
    if (list) {
      std::stable_sort(list->begin(), list->end(), [&](const Item& a, const Item& b) {
        const int ra = vector_rank(forms_, a), rb = vector_rank(forms_, b);
        if (ra != rb) return ra < rb;
        return forms_.term_before(a.whole, forms_.key(a.whole), b.whole, forms_.key(b.whole));
      });
      return items(std::move(*list));
    }
  }
  std::vector<Piece> pieces;
  for (SumId e : entries) pieces.push_back(sum(e));
  return notation_.list(pieces);
}

/// A column of stacked vectors: (m p1″ + z₁ p1, m p2″), where every block of some size has names.
std::optional<Piece> Writer::in_blocks(const std::vector<SumId>& entries) {
  for (std::size_t size = entries.size() / 2; size > 1; --size) {
    if (entries.size() % size != 0) continue;
    std::vector<Piece> pieces;
    for (std::size_t i = 0; i < entries.size(); i += size) {
      const std::vector<SumId> block(entries.begin() + static_cast<long>(i),
                                     entries.begin() + static_cast<long>(i + size));
      const auto list = finder_.items(block);
      if (!list || !list->back().written.empty()) break;
      pieces.push_back(column(block, true));
    }
    if (pieces.size() * size == entries.size()) return notation_.list(pieces);
  }
  return {};
}

/// The number of operations of an atom, with shared parts counted once.
std::size_t Writer::operations(const Atom& a) const {
  std::size_t count = 1;
  if (a.kind == AtomKind::opaque) {
    for (Expr e : topological({&a.node, 1})) count += !e.is_constant() && !e.is_symbol();
    return count - 1;
  }
  std::vector<SumId> stack(a.args);
  std::unordered_map<SumId, bool> seen;
  while (!stack.empty()) {
    const SumId id = stack.back();
    stack.pop_back();
    if (!seen.try_emplace(id, true).second) continue;
    for (const Term& t : forms_.sum(id)) {
      count += std::max<std::size_t>(t.factors.size(), 1);
      for (const Factor& f : t.factors) {
        const auto& args = forms_.atom(f.atom).args;
        count += !args.empty();
        stack.insert(stack.end(), args.begin(), args.end());
      }
    }
  }
  return count;
}

}  // namespace pendula
