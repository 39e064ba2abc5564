#include "expr/print/vectors.hpp"

#include <functional>
#include <map>

namespace pendula {
namespace {

/// The terms of a sum by their factors, with marks for those in use.
class Pool {
 public:
  explicit Pool(const std::vector<Term>& terms) : terms_(terms), taken_(terms.size(), false) {
    for (std::size_t i = 0; i < terms.size(); ++i) place_.emplace(hash(terms[i]), i);
  }
  /// A free term with these factors (collected) and this coefficient.
  std::optional<std::size_t> find(const Term& wanted) const {
    const auto [first, last] = place_.equal_range(hash(wanted));
    for (auto it = first; it != last; ++it)
      if (!taken_[it->second] && terms_[it->second] == wanted) return it->second;
    return {};
  }
  bool taken(std::size_t i) const { return taken_[i]; }
  void take(std::size_t i) { taken_[i] = true; }

 private:
  static std::size_t hash(const Term& t) {
    std::size_t h = 1;
    for (const Factor& f : t.factors)
      h = h * 1000003 + (std::size_t{f.atom} << 8) + std::hash<double>{}(f.exponent.get_d());
    return h;
  }
  const std::vector<Term>& terms_;
  std::vector<bool> taken_;
  std::unordered_multimap<std::size_t, std::size_t> place_;
};

Term without(Term term, std::size_t position) {
  term.factors[position].exponent -= 1;
  if (term.factors[position].exponent == 0)
    term.factors.erase(term.factors.begin() + static_cast<long>(position));
  return term;
}

bool whole_positive(const mpq_class& exponent) { return exponent >= 1 && exponent.get_den() == 1; }

}  // namespace

// ── known columns ──────────────────────────────────────────────────────────────────────────────────────────

Columns::Columns(const PrintOptions& options) : aliases_(options.aliases) {
  std::erase_if(aliases_, [](const VectorName& v) {
    return v.components.size() < 2 ||
           !std::all_of(v.components.begin(), v.components.end(), [](Expr e) { return e.is_symbol(); });
  });
  std::stable_sort(aliases_.begin(), aliases_.end(), [](const VectorName& a, const VectorName& b) {
    return a.components.size() > b.components.size();
  });
  for (std::size_t k = 0; k < aliases_.size(); ++k)
    for (std::size_t i = 0; i < aliases_[k].components.size(); ++i) {
      const Symbol& s = symbol_of(aliases_[k].components[i]);
      places_[s.base].push_back({k, static_cast<int>(i) + 1, s.order});
    }
}

std::vector<Component> Columns::of(Expr leaf) const {
  std::vector<Component> found;
  const Symbol& s = symbol_of(leaf);
  const auto add = [&](const VectorName& v, int index, int order) {
    const auto size = static_cast<int>(v.components.size());
    for (const Component& c : found)
      if (c.size == size) return;
    found.push_back({v.name, size, index, order, v.components});
  };
  if (const auto it = places_.find(s.base); it != places_.end())
    for (const Place& p : it->second)
      if (p.order <= s.order) add(aliases_[p.alias], p.index, s.order - p.order);
  if (s.component > 0) {
    const VectorName declared{s.vector, vector_components(s.vector)};
    const auto i = static_cast<std::size_t>(s.component);
    if (declared.components.size() >= std::max<std::size_t>(i, 2) && declared.components[i - 1] == s.base)
      add(declared, s.component, s.order);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Component& a, const Component& b) { return a.size > b.size; });
  return found;
}

// ── lifting ────────────────────────────────────────────────────────────────────────────────────────────────

const std::vector<Component>& VectorFinder::components_of(AtomId atom) {
  const auto [it, made] = known_.try_emplace(atom);
  if (made && forms_.atom(atom).kind == AtomKind::leaf) it->second = columns_.of(forms_.atom(atom).node);
  return it->second;
}

/// The vector whose component `index` the atom is: a leaf, or a sum with one such leaf in every term.
std::optional<Lift> VectorFinder::lift(AtomId id, int size, int index) {
  for (const Component& c : components_of(id))
    if (c.size == size && c.index == index) return Lift{{Term{1, {}}, c}};
  const Atom& a = forms_.atom(id);
  constexpr std::size_t most = 64;  // a choice: sums of so many vectors have no name that a reader would see
  if (a.kind != AtomKind::sum || forms_.sum(a.args[0]).size() > most) return {};
  Lift combination;
  for (const Term& t : forms_.ordered_terms(a.args[0])) {
    std::optional<std::size_t> carrier;
    for (std::size_t k = 0; k < t.factors.size(); ++k)
      for (const Component& c : components_of(t.factors[k].atom))
        if (c.size == size && c.index == index && whole_positive(t.factors[k].exponent)) {
          if (carrier || t.factors[k].exponent != 1) return {};
          carrier = k;
          combination.push_back({without(t, k), c});
        }
    if (!carrier) return {};
  }
  return combination;
}

/// Component j of a lift as an atom, if the forms contain it.
std::optional<AtomId> VectorFinder::component(const Lift& lift, int j) {
  const auto leaf_of = [&](const Component& c) {
    const Expr base = c.base[j - 1];
    return forms_.leaf_atom(c.order == 0 ? base : derivative_leaf(base, c.order));
  };
  if (lift.size() == 1 && lift[0].scalar == Term{1, {}}) return leaf_of(lift[0].column);
  Sum terms;
  for (const LiftedTerm& t : lift) {
    Term whole = t.scalar;
    whole.factors.push_back({leaf_of(t.column), 1});
    forms_.collect(whole);
    terms.push_back(std::move(whole));
  }
  return forms_.sum_atom(forms_.intern(std::move(terms)));
}

std::vector<VectorFinder::Carrier> VectorFinder::carriers(const Term& term) {
  std::vector<Carrier> found;
  for (std::size_t k = 0; k < term.factors.size(); ++k) {
    if (!whole_positive(term.factors[k].exponent)) continue;
    const AtomId id = term.factors[k].atom;
    const Atom& a = forms_.atom(id);
    if (a.kind == AtomKind::leaf) {
      for (const Component& c : components_of(id)) found.push_back({k, c.size, c.index, {{Term{1, {}}, c}}});
    } else if (a.kind == AtomKind::sum && !forms_.sum(a.args[0]).empty()) {
      const Term first = forms_.sum(a.args[0])[0];  // its leaves limit the possible sizes and indices
      for (const Factor& f : first.factors)
        for (const Component& c : std::vector<Component>(components_of(f.atom)))
          if (auto l = lift(id, c.size, c.index)) found.push_back({k, c.size, c.index, std::move(*l)});
    }
  }
  return found;
}

// ── scalar products ────────────────────────────────────────────────────────────────────────────────────────

std::vector<Item> VectorFinder::items(SumId sum) {
  const std::vector<Term> terms = forms_.ordered_terms(sum);
  Pool pool(terms);
  std::map<std::size_t, Item> found;                                   // by the position of the first term
  std::map<int, std::vector<std::size_t>, std::greater<>> candidates;  // by size of column, longest first
  // a single term is not a scalar product
  for (std::size_t i = 0; i < terms.size() && terms.size() > 1; ++i)
    for (const Carrier& c : carriers(terms[i]))
      if (auto& list = candidates[c.size]; list.empty() || list.back() != i) list.push_back(i);

  // The n terms r·aⱼ·bⱼ, if all of them occur.
  const auto copies = [&](const Term& rest, const Lift& a, const Lift& b, int n) {
    std::vector<std::size_t> places;
    for (int j = 1; j <= n; ++j) {
      Term copy = rest;
      copy.factors.push_back({*component(a, j), 1});
      copy.factors.push_back({*component(b, j), 1});
      forms_.collect(copy);
      const auto place = pool.find(copy);
      if (!place || std::find(places.begin(), places.end(), *place) != places.end())
        return std::vector<std::size_t>{};
      places.push_back(*place);
    }
    return places;
  };
  const auto try_term = [&](std::size_t i, int size) {
    const std::vector<Carrier> list = carriers(terms[i]);
    for (std::size_t x = 0; x < list.size(); ++x)
      for (std::size_t y = x; y < list.size(); ++y) {
        const Carrier &a = list[x], &b = list[y];
        if (a.size != size || b.size != size || a.index != b.index) continue;
        if (a.factor == b.factor && terms[i].factors[a.factor].exponent < 2) continue;
        Term rest = terms[i];
        rest.factors[a.factor].exponent -= 1;
        rest.factors[b.factor].exponent -= 1;
        std::erase_if(rest.factors, [](const Factor& f) { return f.exponent == 0; });
        const auto places = copies(rest, a.lift, b.lift, size);
        if (places.empty()) continue;
        for (std::size_t p : places) pool.take(p);
        found[*std::min_element(places.begin(), places.end())] = {rest, terms[i], {a.lift, b.lift}, 0, {}};
        return;
      }
  };
  for (const auto& [size, list] : candidates)
    for (std::size_t i : list)
      if (!pool.taken(i)) try_term(i, size);

  std::vector<Item> result;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (const auto it = found.find(i); it != found.end()) {
      result.push_back(std::move(it->second));
    } else if (!pool.taken(i)) {
      result.push_back({terms[i], terms[i], {}, 0, {}});
    }
  }
  return result;
}

// ── columns ────────────────────────────────────────────────────────────────────────────────────────────────

std::optional<std::vector<Item>> VectorFinder::items(const std::vector<SumId>& entries) {
  const auto n = static_cast<int>(entries.size());
  std::vector<std::vector<Term>> terms;
  for (SumId e : entries) terms.push_back(forms_.ordered_terms(e));
  std::vector<Pool> pools(terms.begin(), terms.end());
  std::vector<Item> result;

  const auto try_term = [&](std::size_t row, std::size_t i) {
    const Term& t = terms[row][i];
    for (const Carrier& c : carriers(t)) {
      if (c.size != n || c.index != static_cast<int>(row) + 1) continue;
      const Term rest = without(t, c.factor);
      std::vector<std::size_t> places;
      for (int j = 1; j <= n; ++j) {
        Term copy = rest;
        copy.factors.push_back({*component(c.lift, j), 1});
        forms_.collect(copy);
        const auto place = pools[j - 1].find(copy);
        if (!place) break;
        places.push_back(*place);
      }
      if (static_cast<int>(places.size()) < n) continue;
      for (std::size_t j = 0; j < pools.size(); ++j) pools[j].take(places[j]);
      result.push_back({rest, t, {c.lift}, 0, {}});
      return;
    }
  };
  for (std::size_t row = 0; row < terms.size(); ++row)
    for (std::size_t i = 0; i < terms[row].size(); ++i)
      if (!pools[row].taken(i)) try_term(row, i);
  if (result.empty()) return {};

  std::vector<Sum> rest(entries.size());
  std::size_t rows = 0, last = 0;
  for (std::size_t row = 0; row < terms.size(); ++row) {
    for (std::size_t i = 0; i < terms[row].size(); ++i)
      if (!pools[row].taken(i)) rest[row].push_back(terms[row][i]);
    if (!rest[row].empty()) {
      ++rows;
      last = row;
    }
  }
  if (rows == 1 && rest[last].size() == 1) {
    result.push_back({rest[last][0], rest[last][0], {}, static_cast<int>(last) + 1, {}});
  } else if (rows == 1) {
    const Term whole = rest[last][0];
    const AtomId bracket = forms_.sum_atom(forms_.intern(std::move(rest[last])));
    result.push_back({Term{1, {{bracket, 1}}}, whole, {}, static_cast<int>(last) + 1, {}});
  } else if (rows > 1) {
    Item written{Term{1, {}}, Term{1, {}}, {}, 0, {}};
    for (Sum& s : rest) written.written.push_back(forms_.intern(std::move(s)));
    result.push_back(std::move(written));
  }
  return result;
}

}  // namespace pendula
