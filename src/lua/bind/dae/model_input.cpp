// dae{ … } and related functions: make a model from the contents of the braces.
#include <algorithm>
#include <cstring>

#include "base/text.hpp"
#include "dae/model/compose.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/make_model.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/dae/transitions.hpp"
#include "lua/core/library.hpp"
#include "lua/core/memory.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"

namespace pendula::lua {

VecX option_column(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return {};
  const VecX v = to_column(call.L, options.push(key), key);
  lua_pop(call.L, 1);
  return v;
}

namespace {

MatX option_matrix(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return {};
  const MatX m = to_matrix(call.L, options.push(key), key);
  lua_pop(call.L, 1);
  return m;
}

std::vector<dae::Block> to_blocks(const std::vector<Equation>& equations) {
  std::vector<dae::Block> blocks;
  for (const Equation& e : equations) {
    const VecX l = Eigen::Map<const VecX>(e.lhs.data(), e.lhs.size()),
               r = Eigen::Map<const VecX>(e.rhs.data(), e.rhs.size());
    blocks.push_back({l, r, ""});
  }
  return blocks;
}

/// Reads the contents of dae{ … }: equations, lists of equations, models, and the option `name`.
class ModelReader {
 public:
  explicit ModelReader(lua_State* L) : L_(L) {}

  void read(int list, const std::string& what) {
    const Nesting nesting(L_);
    refuse_keys(list, what);
    const lua_Integer n = list_size(L_, list, what);
    for (lua_Integer i = 1; i <= n; ++i) {
      lua_rawgeti(L_, list, i);
      read_entry(lua_gettop(L_), text("entry ", i, " of ", what));
      lua_settop(L_, list);
    }
  }
  std::vector<dae::Block>& blocks() { return blocks_; }
  /// The symbols of the equations and the derivatives that a start may name.
  std::vector<Expr> nameable() const {
    std::vector<Expr> sides, known;
    for (const dae::Block& b : blocks_)
      for (const VecX* side : {&b.lhs, &b.rhs}) sides.insert(sides.end(), side->begin(), side->end());
    for (Expr leaf : leaves(sides)) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind != Kind::variable)
        known.push_back(leaf);
      else  // y′ = v makes y nameable as well
        for (int k = 0; k <= s.order + 1; ++k) known.push_back(derivative_leaf(s.base, k));
    }
    for (const dae::ModelPtr& part : parts_)
      for (Expr leaf : known_leaves(*part)) known.push_back(leaf);
    return known;
  }
  dae::ModelPtr model(dae::ModelOptions options) {
    constexpr std::size_t large = 20'000;  // equations; the garbage of building them is as large as the model
    if (blocks_.size() > large) collect(L_);
    return nested_ ? dae::compose(parts_, std::move(blocks_), std::move(options))
                   : dae::make_model(std::move(blocks_), std::move(options));
  }

 private:
  void read_entry(int at, const std::string& what) {
    if (const auto* part = object_at(L_, at, TypeName<dae::Model>::value)) {
      parts_.push_back(std::static_pointer_cast<const dae::Model>(*part));
      nested_ = true;
      return;
    }
    if (lua_istable(L_, at)) {
      nested_ = true;
      return read(at, what);
    }
    for (dae::Block& block : to_blocks(to_equations(L_, at, what))) blocks_.push_back(std::move(block));
  }
  void refuse_keys(int list, const std::string& what) {
    for (lua_pushnil(L_); lua_next(L_, list) != 0;) {
      lua_pop(L_, 1);
      if (lua_type(L_, -1) == LUA_TSTRING)
        throw Error(text(what, " has the key '", lua_tostring(L_, -1),
                         "' among its equations: write ~, not == or ="));
    }
  }

  lua_State* L_;
  std::vector<dae::Block> blocks_;
  std::vector<dae::ModelPtr> parts_;
  bool nested_ = false;  ///< with models or lists inside, an equation for an input closes a loop
};

/// Values by leaf, numbers or expressions in parameters.
std::vector<std::pair<Expr, Expr>> read_start_expressions(lua_State* L, int index,
                                                          std::span<const Expr> known,
                                                          const std::string& what) {
  std::vector<std::pair<Expr, Expr>> values = read_reset(L, index, known, what);
  for (const auto& [leaf, value] : values)
    for (Expr inside : leaves({&value, 1}))
      if (is_varying(inside))
        throw Error(text(what, ": the value of '", leaf_name(leaf), "' must be a number or an expression in ",
                         "parameters, not ", to_text(value)));
  return values;
}

/// The options of dae{ … } among its equations, by name; they are removed from the table on top.
struct ModelWords {
  static constexpr const char* all[] = {"name", "events", "start", "guess", "notes"};
  static bool contains(const char* word) {
    return std::any_of(std::begin(all), std::end(all),
                       [&](const char* w) { return std::strcmp(w, word) == 0; });
  }
};

void read_model_words(lua_State* L, int words, ModelReader& reader, dae::ModelOptions& options) {
  std::vector<dae::Block>& blocks = reader.blocks();
  const auto word = [&](const char* key) { return lua_getfield(L, words, key) != LUA_TNIL; };
  const std::vector<Expr> known = reader.nameable();
  if (word("name")) {
    if (lua_type(L, -1) != LUA_TSTRING) throw Error(text("name must be a string, got ", describe(L, -1)));
    options.name = lua_tostring(L, -1);
  }
  if (word("start")) options.start_values = read_start_expressions(L, lua_gettop(L), known, "start");
  if (word("guess")) options.start_guesses = read_start_expressions(L, lua_gettop(L), known, "guess");
  if (word("events")) {
    const int list = lua_gettop(L);
    if (!lua_istable(L, list)) throw Error("events must be a list of tables { { when = y, reset = { … } } }");
    for (lua_Integer i = 1, n = list_size(L, list, "events"); i <= n; ++i) {
      lua_geti(L, list, i);
      const std::string what = text("events[", i, "]");
      options.events.push_back(read_transition(L, lua_gettop(L), known, what));
      lua_pushliteral(L, "call");
      if (lua_rawget(L, -2) != LUA_TNIL)
        throw Error(text(what, ".call: an event of a model cannot call; give it to integrate{ events = … }"));
      lua_settop(L, list);
    }
  }
  if (word("notes")) {
    if (!lua_istable(L, -1)) throw Error("notes must be a list of strings, one for each equation");
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (lua_rawgeti(L, -1, static_cast<lua_Integer>(b + 1)) == LUA_TSTRING)
        blocks[b].note = lua_tostring(L, -1);
      lua_pop(L, 1);
    }
  }
  lua_settop(L, words);
}

/// Does the list contain parts? Then it is an argument of model{ … }.
bool contains_parts(lua_State* L, int list) {
  for (lua_Integer i = 1, n = luaL_len(L, list); i <= n; ++i) {
    lua_rawgeti(L, list, i);
    const bool found = lua_istable(L, -1) && luaL_getmetafield(L, -1, "__model") != LUA_TNIL;
    lua_settop(L, list);
    if (found) return true;
  }
  return false;
}

int make(Call& call) {
  lua_State* L = call.L;
  call.table(1, "equations");
  lua_settop(L, 1);
  if (contains_parts(L, 1)) {
    push_named(L, "model");
    lua_pushvalue(L, 1);
    protected_call(L, 1, 1);
    return 1;
  }
  lua_newtable(L);  // the options
  lua_newtable(L);  // the equations
  const int words = 2, list = 3;
  for (lua_pushnil(L); lua_next(L, 1);) {
    const bool option = lua_type(L, -2) == LUA_TSTRING && ModelWords::contains(lua_tostring(L, -2));
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_settable(L, option ? words : list);
  }
  ModelReader reader(L);
  reader.read(list, "the list of equations");
  dae::ModelOptions options;
  read_model_words(L, words, reader, options);
  return call.push(reader.model(std::move(options)));
}

int make_semi_explicit(Call& call) {
  const Options o = call.options(1);
  if (!o.has("x") || !o.has("f")) throw Error("expected { x =, z =, u =, f =, g = }: x and f are required");
  return call.push(dae::semi_explicit(option_column(call, o, "x"), option_column(call, o, "z"),
                                      option_column(call, o, "u"), option_column(call, o, "f"),
                                      option_column(call, o, "g"), o.string("name", "")));
}

int make_implicit(Call& call) {
  const Options o = call.options(1);
  if (!o.has("F")) throw Error("expected { x =, z =, u =, F = }: F(x′, x, z, u) is required");
  return call.push(dae::implicit(option_column(call, o, "x"), option_column(call, o, "z"),
                                 option_column(call, o, "u"), option_column(call, o, "F"),
                                 o.string("name", "")));
}

int make_linear(Call& call) {
  const Options o = call.options(1);
  if (!o.has("E") || !o.has("A")) throw Error("expected { E =, A =, B =, u = }: E and A are required");
  return call.push(dae::linear(option_matrix(call, o, "E"), option_matrix(call, o, "A"),
                               option_matrix(call, o, "B"), option_column(call, o, "x"),
                               option_column(call, o, "u"), o.string("name", "")));
}

const OptionTable semi_explicit_options = {
    {"x", "column or list", "", "the states"},
    {"z", "column or list", "{}", "the algebraic variables"},
    {"u", "column or list", "{}", "the inputs"},
    {"f", "column or list", "", "x′"},
    {"g", "column or list", "{}", "the residuals that are 0"},
    {"name", "string", "", "the name of the model"},
};
const OptionTable implicit_options = {
    {"x", "column or list", "", "the states"},
    {"z", "column or list", "{}", "the algebraic variables"},
    {"u", "column or list", "{}", "the inputs"},
    {"F", "column or list", "", "the residuals that are 0, in x′, x, z, u"},
    {"name", "string", "", "the name of the model"},
};
const OptionTable linear_options = {
    {"E", "matrix", "", "of x′"},
    {"A", "matrix", "", "of x"},
    {"B", "matrix", "", "of u"},
    {"x", "column", "", "the variables; made if they are not given"},
    {"u", "column", "", "the inputs; made if they are not given"},
    {"name", "string", "", "the name of the model"},
};

}  // namespace

extern const Module model_input_module = {
    "dae",
    "Differential-algebraic equations",
    {
        {"dae", make, R"(dae{ equation, equation, …, name =, start =, guess =, events =, notes = } -> model)",
         R"(A model from any mix of scalar and column equations (lhs ~ rhs). Unknowns are the variables
            that occur; inputs and parameters are recognised. A model, or a list of equations, may stand among
            the equations; an equation for an input of such a model closes the loop: dae{ plant, F ~ -10*x }.
            start = { [x] = 1 } and guess are values that every start of the model has unless it says otherwise,
            events = { { when =, direction =, reset = { … } } } happen in every run, notes stand beside the
            equations. With parts among the equations it is model{ … }.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z - x, 0 ~ x + 2*z }.kind)", "semi-explicit"},
        {"dae.semi_explicit", make_semi_explicit,
         "dae.semi_explicit{ x =, z =, u =, f =, g =, name = } -> model",
         "x′ = f(x, z, u), 0 = g(x, z, u). Symbols that are not declared in x, z, u are refused.",
         R"(x, z = vars "x z"  return dae.semi_explicit{ x = x, z = z, f = z - x, g = x + 2*z }:index())",
         "1", &semi_explicit_options},
        {"dae.implicit", make_implicit, "dae.implicit{ x =, z =, u =, F =, name = } -> model",
         "F(x′, x, z, u) = 0.", R"(x = var "x"  return dae.implicit{ x = x, F = der(x)^3 + x }.kind)",
         "implicit ODE", &implicit_options},
        {"dae.linear", make_linear, "dae.linear{ E =, A =, B =, x =, u = } -> model",
         "E x′ = A x + B u; x and u are made if they are not given.",
         "return #dae.linear{ E = {{1, 0}, {0, 0}}, A = eye(2) }.differential", "1", &linear_options},
    }};

}  // namespace pendula::lua
