// Symbols, tables keyed by symbols, lists of equations, and the names of columns for printing.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"
#include "expr/print/spelling.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

struct Name {
  std::string base;
  int order;
};

/// Splits "x''" into x and 2. The typographic ′ and ″, which are printed, are accepted as well.
Name split_name(std::string word) {
  Name name{std::move(word), 0};
  for (const auto& [mark, order] : {std::pair{"'", 1}, {"′", 1}, {"″", 2}, {"‴", 3}})
    while (name.base.ends_with(mark)) {
      name.base.resize(name.base.size() - std::strlen(mark));
      name.order += order;
    }
  return name;
}

std::vector<std::string> names_of(std::span<const Expr> known) {
  std::vector<std::string> names;
  for (Expr leaf : known) {
    names.push_back(leaf_name(leaf));
    const Symbol& s = symbol_of(leaf);
    if (!s.vector.empty() && s.component == 1) names.push_back(s.vector + std::string(s.order, '\''));
  }
  return names;
}

/// All entries of the declared column, including those that are not among the known ones.
std::vector<Expr> whole_column(const std::vector<Expr>& known, const std::string& name) {
  std::vector<Expr> all = vector_components(name);
  const int order = symbol_of(known[0]).order;
  if (order > 0)
    for (Expr& leaf : all) leaf = derivative_leaf(leaf, order);
  return std::find(all.begin(), all.end(), known[0]) == all.end() ? known : all;
}

/// Rewrites "x.dot", "x_dot", "x.ddot" to "x'", "x''"; "" if the word does not end so.
std::string with_marks(const std::string& word) {
  for (const auto& [suffix, marks] : {std::pair{"ddot", "''"}, {"dot", "'"}})
    for (const char* joint : {".", "_"}) {
      const std::string ending = std::string(joint) + suffix;
      if (word.size() > ending.size() && word.ends_with(ending))
        return word.substr(0, word.size() - ending.size()) + marks;
    }
  return "";
}

/// A hint for "xdot" and "dx" if there is an x.
std::string derivative_hint(const std::string& word, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (word == name + "dot" || word == "d" + name || word == name + "_d" || word == name + "p")
      return text(" The derivative of ", name, " is written [", name, ".dot], as a name \"", name, "'\".");
  return "";
}

/// Lists the known symbols if no name is similar.
std::string symbols_at_hand(std::span<const Expr> known) {
  constexpr std::size_t most = 8;
  std::vector<std::string> names;
  for (Expr leaf : known) {
    const std::string name = to_text(leaf);
    if (symbol_of(leaf).order == 0 && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  }
  if (names.empty()) return "";
  if (names.size() > most) {
    names.resize(most);
    names.back() = "…";
  }
  return text(" Known here: ", join(names, ", "), ".");
}

[[noreturn]] void refuse_unknown(const std::string& word, const std::string& what,
                                 std::span<const Expr> known) {
  const std::vector<std::string> names = names_of(known);
  const std::string hint = derivative_hint(word, names);
  std::string remedy = hint.empty() ? did_you_mean(word, names) : hint;
  if (remedy.empty()) remedy = symbols_at_hand(known);
  throw Error(text(what, ": unknown symbol '", word, "'.", remedy));
}

std::vector<Expr> leaves_named(const std::string& word, const std::string& what, std::span<const Expr> known,
                               Spellings& spellings) {
  const Name name = split_name(word);
  std::vector<Expr> exact, components;
  for (Expr leaf : known) {
    const Symbol& s = symbol_of(leaf);
    if (s.order != name.order) continue;
    const bool listed = std::find(exact.begin(), exact.end(), leaf) != exact.end();
    if (s.name == name.base && !listed) exact.push_back(leaf);
    if (s.vector == name.base) components.push_back(leaf);
  }
  if (exact.size() > 1)
    throw Error(text(what, ": there are two symbols named '", word,
                     "' (of different kinds); use the symbol, not its name"));
  const bool scalar =
      !exact.empty() && (components.empty() ||  // the name means its last use
                         latest_declaration_of(components[0]) < latest_declaration_of(exact[0]));
  if (scalar) return exact;
  std::sort(components.begin(), components.end(),
            [](Expr a, Expr b) { return symbol_of(a).component < symbol_of(b).component; });
  components.erase(std::unique(components.begin(), components.end()), components.end());
  if (!components.empty()) return whole_column(components, name.base);
  if (const std::string marked = with_marks(word); !marked.empty())
    return leaves_named(marked, what, known, spellings);
  if (const auto leaf = spellings.leaf(word)) return {*leaf};
  refuse_unknown(word, what, known);
}

std::vector<Expr> leaves_at(lua_State* L, int index, const std::string& what, std::span<const Expr> known,
                            Spellings& spellings);

std::vector<Expr> leaves_of_list(lua_State* L, int list, const std::string& what, std::span<const Expr> known,
                                 Spellings& spellings) {
  const Nesting nesting(L);
  std::vector<Expr> all;
  const lua_Integer n = list_size(L, list, what);
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(L, list, i);
    const auto some = leaves_at(L, lua_gettop(L), text("entry ", i, " of ", what), known, spellings);
    all.insert(all.end(), some.begin(), some.end());
    lua_pop(L, 1);
  }
  return all;
}

void refuse_key(lua_State* L, int key, const std::string& what) {
  if (lua_type(L, key) == LUA_TSTRING || lua_type(L, key) == LUA_TUSERDATA) return;
  throw Error(text(what, " must be keyed by symbols or names, { [x] = 1 } or { x = 1 }, but it has the key [",
                   key_in_words(L, key), "]"));
}

void refuse_repetition(std::vector<SymbolEntry>& entries, const std::string& what) {
  std::unordered_map<Expr, const SymbolEntry*> seen;
  for (const SymbolEntry& entry : entries)
    for (Expr leaf : entry.leaves)
      if (const auto [it, fresh] = seen.emplace(leaf, &entry); !fresh)
        throw Error(text(what, " gives '", leaf_name(leaf), "' twice: ",
                         it->second->key() == entry.key()
                             ? "by the symbol and by its name"
                             : text("with '", it->second->key(), "' and with '", entry.key(), "'")));
}

std::vector<Expr> leaves_at(lua_State* L, int index, const std::string& what, std::span<const Expr> known,
                            Spellings& spellings) {
  index = lua_absindex(L, index);
  if (lua_type(L, index) == LUA_TSTRING) return leaves_named(lua_tostring(L, index), what, known, spellings);
  if (lua_istable(L, index)) return leaves_of_list(L, index, what, known, spellings);
  if (!object<Expr>(L, index) && !object<Matrix>(L, index))
    throw Error(text(what, " must be a symbol, a column of symbols or a name, not ", describe(L, index)));
  const MatX m = to_matrix(L, index, what);
  for (Expr e : entries(m))
    if (!e.is_symbol() || symbol_of(e).kind == Kind::constant)
      throw Error(text(what, " must be a symbol, not the expression ", to_text(e)));
  return {m.data(), m.data() + m.size()};
}

[[noreturn]] void not_an_equation(lua_State* L, int index, const std::string& what) {
  const char* advice = "write lhs ~ rhs";
  if (lua_isboolean(L, index)) advice = "write ~, not == or =";
  if (lua_type(L, index) == LUA_TNUMBER) advice = "write ~, not == or =, between expressions";
  if (object<Expr>(L, index) || object<Matrix>(L, index)) advice = "write 0 ~ expression";
  throw Error(text(what, " must be an equation, not ", describe(L, index), ": ", advice));
}

}  // namespace

struct Declarations {
  std::vector<Expr> list;
  std::unordered_set<Expr> seen;
};
static Declarations& declarations() {
  static Declarations d;
  return d;
}

const std::vector<Expr>& declared_symbols() { return declarations().list; }

void note_declared(std::span<const Expr> leaves) {
  for (Expr leaf : leaves)
    if (declarations().seen.insert(leaf).second) declarations().list.push_back(leaf);
}

void begin_session() {
  declarations() = {};
  begin_declarations();
}

std::string leaf_name(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  return s.name + std::string(s.order, '\'');
}

std::vector<Expr> to_leaves(lua_State* L, int index, const std::string& what, std::span<const Expr> known) {
  Spellings spellings(known);
  return leaves_at(L, index, what, known, spellings);
}

void each_symbol_entry(lua_State* L, int table, const std::string& what, std::span<const Expr> known,
                       const std::function<void(const SymbolEntry&)>& visit) {
  table = lua_absindex(L, table);
  if (!lua_istable(L, table))
    throw Error(text(what, " must be a table { [x] = 1, … }, not ", describe(L, table)));
  luaL_checkstack(L, 8, nullptr);
  lua_newtable(L);  // the values, in the order of lua_next
  const int values = lua_gettop(L);
  std::vector<SymbolEntry> found;
  Spellings spellings(known);
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    const int key = lua_gettop(L) - 1;
    refuse_key(L, key, what);
    const std::string where = lua_type(L, key) == LUA_TSTRING ? what : "a key of " + what;
    SymbolEntry entry{leaves_at(L, key, where, known, spellings),
                      lua_type(L, key) == LUA_TSTRING ? lua_tostring(L, key) : "",
                      static_cast<int>(found.size()) + 1};
    if (entry.leaves.empty()) throw Error(text(what, " has an empty column as a key"));
    lua_rawseti(L, values, entry.value);  // pops the value
    found.push_back(std::move(entry));
  }
  // By leaf, then by key: duplicate first leaves are an error, whose text must not depend on the hash order.
  std::sort(found.begin(), found.end(), [](const SymbolEntry& a, const SymbolEntry& b) {
    const auto place_of = [](const SymbolEntry& e) {
      return std::pair(declaration_of(e.leaves[0]), symbol_of(e.leaves[0]).order);
    };
    const auto first = place_of(a), second = place_of(b);
    return first != second ? first < second : a.key() < b.key();
  });
  refuse_repetition(found, what);
  for (SymbolEntry& entry : found) {
    lua_rawgeti(L, values, entry.value);
    entry.value = lua_gettop(L);
    visit(entry);
    lua_settop(L, values);
  }
  lua_settop(L, values - 1);
}

void each_known_entry(lua_State* L, int table, const std::string& what, std::span<const Expr> known,
                      const std::function<void(const SymbolEntry&)>& visit) {
  const std::unordered_set<Expr> all(known.begin(), known.end());
  each_symbol_entry(L, table, what, known, [&](const SymbolEntry& entry) {
    for (Expr leaf : entry.leaves)
      if (!all.contains(leaf)) refuse_unknown(leaf_name(leaf), what, known);
    visit(entry);
  });
}

std::string SymbolEntry::key() const {
  if (!name.empty()) return name;
  return leaves.size() == 1 ? leaf_name(leaves[0]) : vector_to_text(column(leaves));
}

/// Adds a number, or a list with one number per leaf. False for anything else.
static bool add_plain_numbers(lua_State* L, const SymbolEntry& entry,
                              std::vector<std::pair<Expr, double>>& numbers) {
  const std::size_t size = entry.leaves.size();
  if (size == 1 && lua_type(L, entry.value) == LUA_TNUMBER) {
    numbers.emplace_back(entry.leaves[0], lua_tonumber(L, entry.value));
    return true;
  }
  if (size == 1 || !lua_istable(L, entry.value) || lua_rawlen(L, entry.value) != size) return false;
  std::size_t all = 0;
  for (lua_pushnil(L); lua_next(L, entry.value) != 0; lua_pop(L, 1)) ++all;
  if (all != size) return false;
  const std::size_t before = numbers.size();
  for (std::size_t i = 0; i < size; ++i) {
    lua_rawgeti(L, entry.value, static_cast<lua_Integer>(i) + 1);
    const bool plain = lua_type(L, -1) == LUA_TNUMBER;
    if (plain) numbers.emplace_back(entry.leaves[i], lua_tonumber(L, -1));
    lua_pop(L, 1);
    if (plain) continue;
    numbers.resize(before, {Expr(0), 0});
    return false;
  }
  return true;
}

std::vector<std::pair<Expr, double>> to_symbol_numbers(lua_State* L, int table, const std::string& what,
                                                       std::span<const Expr> known) {
  std::vector<std::pair<Expr, double>> numbers;
  each_symbol_entry(L, table, what, known, [&](const SymbolEntry& entry) {
    if (add_plain_numbers(L, entry, numbers)) return;
    const std::string where = text(what, ": the value of '", entry.key(), "'");
    if (entry.leaves.size() == 1 && !lua_istable(L, entry.value) && !object<Matrix>(L, entry.value)) {
      numbers.emplace_back(entry.leaves[0], to_number(L, entry.value, where));
      return;
    }
    const Vec values = to_numbers(L, entry.value, where);
    if (values.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(text(where, " has ", values.size(), values.size() == 1 ? " entry" : " entries", ", but '",
                       entry.key(), "' has ", entry.leaves.size(),
                       values.size() == 1 ? text("; one value for all is ", shortest(values[0]), "*ones(",
                                                 entry.leaves.size(), ", 1)")
                                          : ""));
    for (std::size_t i = 0; i < entry.leaves.size(); ++i) numbers.emplace_back(entry.leaves[i], values[i]);
  });
  for (const auto& [leaf, value] : numbers)
    if (!std::isfinite(value))
      throw Error(text(what, ": the value of '", leaf_name(leaf), "' is ", shortest(value)));
  return numbers;
}

std::vector<Equation> to_equations(lua_State* L, int index, const std::string& what) {
  index = lua_absindex(L, index);
  if (const Equation* one = object<Equation>(L, index)) return {*one};
  if (!lua_istable(L, index)) not_an_equation(L, index, what);
  std::vector<Equation> equations;
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    lua_pop(L, 1);
    if (lua_type(L, -1) == LUA_TSTRING)
      throw Error(
          text(what, " has the key '", lua_tostring(L, -1), "' among its equations: write ~, not == or ="));
  }
  const lua_Integer n = list_size(L, index, what);
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(L, index, i);
    const Equation* equation = object<Equation>(L, -1);
    if (!equation) not_an_equation(L, lua_gettop(L), text("entry ", i, " of ", what));
    equations.push_back(*equation);
    lua_pop(L, 1);
  }
  return equations;
}

// ── names ──

std::string label_of(Expr e) {
  if (!e.is_symbol()) return to_text(e);
  const Symbol& s = symbol_of(e);
  const bool of_part = s.name.find('.') != std::string::npos;  // every capacitor has a "voltage"
  const std::string words = s.label.empty() || of_part ? to_text(e) : s.label;
  const std::string unit = unit_text(e);
  return unit.empty() ? words : text(words, " [", unit, "]");
}

namespace {

/// The components if the value on top of the stack is a column of two or more different symbols of order 0.
std::vector<Expr> column_on_top(lua_State* L) {
  const Matrix* m = object<Matrix>(L, -1);
  if (!m || m->numeric() || m->cols() != 1 || m->rows() < 2) return {};
  const auto all = entries(std::get<MatX>(m->store));
  for (Expr e : all)
    if (!e.is_symbol() || symbol_of(e).order != 0) return {};
  std::vector<Expr> components(all.begin(), all.end()), sorted = components;
  std::sort(sorted.begin(), sorted.end(), [](Expr a, Expr b) { return a.id() < b.id(); });
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return {};
  return components;
}

/// A column keeps its declared name: var("q", 6) is q, whichever variable contains it.
bool declared(const std::vector<Expr>& components) {
  const Symbol& first = symbol_of(components[0]);
  return !first.vector.empty() && vector_components(first.vector) == components;
}

using Aliases = std::map<std::vector<std::uint32_t>, VectorName>;

void offer_name(lua_State* L, const char* name, Aliases& aliases) {
  std::vector<Expr> components = column_on_top(L);
  if (components.empty() || declared(components) || name[0] == '(') return;
  std::vector<std::uint32_t> ids;
  for (Expr e : components) ids.push_back(e.id());
  const auto [it, made] = aliases.try_emplace(ids, VectorName{name, components});
  const std::string& taken = it->second.name;
  const std::string offered = name;
  // The shortest name, then the first in the alphabet, so that the choice does not depend on the order of
  // a hash table.
  if (!made && std::pair(offered.size(), offered) < std::pair(taken.size(), taken)) it->second.name = offered;
}

/// Adds the names of locals and upvalues of a running function of the user.
void names_in_frame(lua_State* L, lua_Debug& frame, Aliases& aliases) {
  for (int i = 1; const char* name = lua_getlocal(L, &frame, i); ++i) {
    offer_name(L, name, aliases);
    lua_pop(L, 1);
  }
  lua_getinfo(L, "f", &frame);
  const int function = lua_gettop(L);
  for (int i = 1; const char* name = lua_getupvalue(L, function, i); ++i) {
    offer_name(L, name, aliases);
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
}

void names_in_globals(lua_State* L, Aliases& aliases) {
  lua_pushglobaltable(L);
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    const bool named = lua_type(L, -2) == LUA_TSTRING && std::strcmp(lua_tostring(L, -2), "ans") != 0;
    if (named) offer_name(L, lua_tostring(L, -2), aliases);
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
}

}  // namespace

void collect_aliases(lua_State* L) {
  constexpr int deepest = 64;  // a deep recursion has the same variables in every frame
  luaL_checkstack(L, 8, nullptr);
  Aliases aliases;
  lua_Debug frame;
  for (int level = 0; level < deepest && lua_getstack(L, level, &frame) != 0; ++level) {
    lua_getinfo(L, "S", &frame);
    if (*frame.what == 'C' || std::strncmp(frame.source, "=stdlib/", 8) == 0) continue;
    names_in_frame(L, frame, aliases);
  }
  names_in_globals(L, aliases);
  std::vector<VectorName>& names = default_print_options().aliases;
  names.clear();
  for (auto& [ids, name] : aliases) names.push_back(std::move(name));
}

}  // namespace pendula::lua
