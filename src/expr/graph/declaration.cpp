#include "expr/graph/declaration.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <unordered_map>

#include "expr/graph/mix.hpp"

namespace pendula {
namespace {

/// Positions in the order of declaration. A symbol that existed before gets its position when it is declared,
/// so that in params "a d" a known a precedes a new d.
struct Declared {
  std::uint64_t first, latest;
  bool only_made, by_user = false;
};

struct Declarations {
  std::unordered_map<Expr, Declared> places;
  std::unordered_map<Expr, Expr> derivatives;  ///< unknowns of reduced forms that represent one
  std::uint64_t count = 0, session_begin = 0;
};

Declarations& declarations() {
  static Declarations d;
  return d;
}

Declared place_of(Expr base) { return declarations().places.at(base); }

template <class Place>
void sort_by(std::vector<Expr>& leaves, Place place) {
  if (leaves.size() < 2) return;
  std::vector<std::tuple<int, std::uint64_t, Expr>> keyed;
  keyed.reserve(leaves.size());
  for (Expr leaf : leaves) keyed.emplace_back(symbol_of(leaf).order, place(leaf), leaf);
  std::sort(keyed.begin(), keyed.end(), [](const auto& a, const auto& b) {
    return std::get<0>(a) != std::get<0>(b) ? std::get<0>(a) < std::get<0>(b)
                                            : std::get<1>(a) < std::get<1>(b);
  });
  for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i] = std::get<2>(keyed[i]);
}

}  // namespace

void newly_made(Expr symbol) {
  Declarations& d = declarations();
  ++d.count;
  d.places.try_emplace(symbol, Declared{d.count, d.count, true});
}

static std::vector<Expr> declared(std::vector<Expr> symbols, bool by_user) {
  Declarations& d = declarations();
  for (Expr leaf : symbols) {
    Declared& place = d.places.at(leaf);
    const bool is_new = place.only_made || place.first <= d.session_begin;
    place.latest = ++d.count;
    if (is_new) place.first = d.count;
    place.by_user = by_user || (place.by_user && !is_new);
    place.only_made = false;
    d.derivatives.erase(leaf);
  }
  return symbols;
}

std::vector<Expr> newly_declared(std::vector<Expr> symbols) { return declared(std::move(symbols), true); }

Expr newly_declared_by_form(Expr unknown) { return declared({unknown}, false)[0]; }

Expr declared_for(Expr derivative, Expr unknown) {
  Declarations& d = declarations();
  newly_declared_by_form(unknown);
  if (!place_of(unknown).by_user) d.derivatives[unknown] = derivative;
  return unknown;
}

std::optional<Expr> stands_for(Expr unknown) {
  const auto& known = declarations().derivatives;
  const auto at = known.find(unknown);
  return at == known.end() ? std::nullopt : std::optional(at->second);
}

void begin_declarations() { declarations().session_begin = declarations().count; }
std::uint64_t session_of_declarations() { return declarations().session_begin; }

std::uint64_t declaration_of(Expr leaf) { return place_of(symbol_of(leaf).base).first; }
std::uint64_t latest_declaration_of(Expr leaf) { return place_of(symbol_of(leaf).base).latest; }

void sort_by_declaration(std::vector<Expr>& leaves) { sort_by(leaves, declaration_of); }
void sort_by_latest_declaration(std::vector<Expr>& leaves) { sort_by(leaves, latest_declaration_of); }

std::uint64_t name_hash(Expr leaf) {
  const bool is_call = leaf.op() == Op::call;
  const std::string& name = is_call ? call_of(leaf).name : symbol_of(leaf).name;
  std::uint64_t h = is_call ? 17 : static_cast<std::uint64_t>(symbol_of(leaf).kind);
  for (char c : name) h = mix(h ^ static_cast<unsigned char>(c)) + 0x9e3779b97f4a7c15ull;
  if (!is_call) return mix(h ^ static_cast<std::uint64_t>(symbol_of(leaf).order));
  for (int k : call_of(leaf).partial) h = mix(h ^ static_cast<std::uint64_t>(k)) + 0x9e3779b97f4a7c15ull;
  return h;
}

}  // namespace pendula
