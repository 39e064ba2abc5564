// Consistent starts: init, ledgers, and the starts that integrate accepts. Reads arguments, calls src/dae.
#include <cstdio>

#include "base/text.hpp"
#include "dae/report/report_latex.hpp"
#include "dae/start/start.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/objects.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {
namespace {

int init(Call& call) {
  const auto model = call.shared<dae::Model>(1, "model");
  const Options o = call.options(2);
  dae::StartRequest request = read_start_request(call.L, o, *model);
  request.keep_invariants = o.boolean("consistent", true);
  request.nearest = o.boolean("nearest", false);
  if (o.boolean("declared", true)) add_declared(request, *model);
  const dae::ConsistentStatePtr at =
      model->form == "array" ? start_of_rows(request, model) : dae::init(model, request);
  std::size_t told = 0;
  constexpr std::size_t most = 20;
  for (const dae::Moved& m : at->moved)
    if (++told <= most || at->moved.size() <= most + 1)
      std::printf("nearest: %s moved from %s to %s\n", to_text(m.leaf).c_str(), rounded(m.from).c_str(),
                  rounded(m.to).c_str());
  if (at->moved.size() > most + 1)
    std::printf("nearest: … %zu more (the ledger has all %zu)\n", at->moved.size() - most, at->moved.size());
  if (at->lost) warn(at->lost_digits_text());
  return call.push(at);
}

const dae::ConsistentState& start_of(Call& call) { return call.object<dae::ConsistentState>(1, "start"); }

int start_value(Call& call) {
  const dae::ConsistentState& at = start_of(call);
  const bool name = lua_type(call.L, 2) == LUA_TSTRING;
  const MatX e = name ? MatX(column(to_leaves(call.L, 2, "expression", known_leaves(*at.model))))
                      : to_matrix(call.L, 2, "expression");
  Mat value(e.rows(), e.cols());
  for (Eigen::Index i = 0; i < e.size(); ++i) value.data()[i] = at(e.data()[i]);
  return value.size() == 1 ? call.push(value(0, 0)) : push_matrix(call.L, value);
}

int start_model(Call& call) { return call.push(call.object<dae::ConsistentState>(1, "start").model); }

int start_latex(Call& call) {
  collect_aliases(call.L);
  return call.push(dae::latex(call.object<dae::ConsistentState>(1, "start")));
}

int start_ledger(Call& call) {
  collect_aliases(call.L);
  const std::string ledger = start_of(call).ledger();
  return call.push(ledger.substr(0, ledger.size() - 1));
}

int start_text(Call& call) { return start_ledger(call); }
int push_given(lua_State* L, const dae::LeafValues& values) {
  lua_newtable(L);
  for (const auto& [leaf, value] : values) {
    push_expr(L, leaf);
    lua_pushnumber(L, value);
    lua_rawset(L, -3);
  }
  return 1;
}
int start_fix(Call& call) { return push_given(call.L, start_of(call).request.fix); }
int start_guess(Call& call) { return push_given(call.L, start_of(call).request.guess); }
int start_inputs(Call& call) {
  lua_newtable(call.L);
  for (const auto& [leaf, value] : start_of(call).request.inputs) {
    if (symbol_of(leaf).order > 0) continue;
    push_expr(call.L, leaf);
    push_expr(call.L, value);
    lua_rawset(call.L, -3);
  }
  return 1;
}
int start_params(Call& call) {
  lua_newtable(call.L);
  for (const auto& [leaf, value] : start_of(call).request.parameters) {
    push_expr(call.L, leaf);
    push_expr(call.L, value);
    lua_rawset(call.L, -3);
  }
  return 1;
}
int start_time(Call& call) { return call.push(start_of(call).t); }
int start_free(Call& call) { return call.push(start_of(call).free); }

void set_number(lua_State* L, const char* key, double value) {
  lua_pushnumber(L, value);
  lua_setfield(L, -2, key);
}

/// A list of { variable =, from =, to = }.
int start_moved(Call& call) {
  lua_newtable(call.L);
  int i = 0;
  for (const dae::Moved& m : start_of(call).moved) {
    lua_newtable(call.L);
    push_expr(call.L, m.leaf);
    lua_setfield(call.L, -2, "variable");
    set_number(call.L, "from", m.from);
    set_number(call.L, "to", m.to);
    lua_rawseti(call.L, -2, ++i);
  }
  return 1;
}

/// A list of { variable =, here =, there =, formula = }.
int start_branches(Call& call) {
  lua_newtable(call.L);
  int i = 0;
  for (const dae::Branch& b : start_of(call).branches()) {
    lua_newtable(call.L);
    push_expr(call.L, b.leaf);
    lua_setfield(call.L, -2, "variable");
    set_number(call.L, "here", b.here);
    set_number(call.L, "there", b.there);
    lua_pushlstring(call.L, b.formula.data(), b.formula.size());
    lua_setfield(call.L, -2, "formula");
    lua_rawseti(call.L, -2, ++i);
  }
  return 1;
}

const OptionTable init_options = {
    {"fix", "table", "", "values that hold at the start: { x = 1, [x.dot] = 0, [p] = {1, 0, 0} }",
     "@variables"},
    {"guess", "table", "", "where the search for the other values begins; it also chooses what is free",
     "@variables"},
    {"inputs", "table", "", "{ [u] = … } as in integrate", "@inputs"},
    {"params", "table", "", "values of parameters: { m = 2 }", "@parameters"},
    {"from", "number", "0", "the time of the start, in s"},
    {"consistent", "boolean", "true",
     "false: a reduced form may start off the constraints it no longer imposes"},
    {"declared", "boolean", "true",
     "false: values that the model declares, dae{ …, start = { … } }, do not hold"},
    {"nearest", "boolean", "false", "move contradictory fixes onto the constraints, as little as possible"},
};

}  // namespace

extern const Module start_module = {
    "start",
    "Consistent starts",
    {
        {"model:init", init,
         R"(sys:init{ fix =, guess =, inputs =, params =, from =, nearest = false, consistent = true,
            declared = true } -> start)",
         R"(A consistent start at any index. fix is a condition, guess only a starting point. Errors name
            conflicting fixes with the equation they violate, or the candidates that are free and a call
            that works. nearest = true moves contradictory fixes onto the constraints, as little as
            possible in units of their own, and prints what moved. consistent = false lets a reduced form
            start off the constraints it no longer imposes, to study drift. The result does not depend on
            units.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z - x, 0 ~ x + 2*z }:init{ fix = { x = 2 } }(z))", "-1.0",
         &init_options},
        {"start:__call", start_value, "at(expression) -> number or matrix",
         "The value of any expression at the start, accelerations and multipliers included.", R"(
             x, z = vars "x z"
             at = dae{ der(x) ~ z, 0 ~ x - sin(t) }:init{}
             at(z), at(2*z + der(x)))",
         "1.0 3.0"},
        {"start#model", start_model, "at.model -> model", "The model that the start was made for.", "", ""},
        {"start:ledger", start_ledger, "at:ledger() -> string",
         "Every variable: fixed, free, computed; the residual of every constraint.",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:init{}:ledger())",
         R"(consistent start at t = 0: 0 free initial values
  x   0  computed
  x′  1  computed
  z   1  computed
constraints
  (2)  ≤ 1e-12  0 = x - sin(t))"},
        {"start:latex", start_latex, "at:latex() -> string",
         "The ledger in LaTeX: a fragment for amsmath; save \"x.tex\" makes a document of it.", R"(
             x, z = vars "x z"
             dae{ der(x) ~ z, 0 ~ x - sin(t) }:init{}:latex())"},
        {"start#free", start_free, "at.free -> integer", "The number of initial values that could be chosen.",
         "", ""},
        {"start#moved", start_moved, "at.moved -> list of { variable =, from =, to = }",
         "The fixed values that nearest = true moved.", "", ""},
        {"start:branches", start_branches,
         "at:branches() -> list of { variable =, here =, there =, formula = }",
         "Other roots of the equations for the same fixes; a guess near `there` chooses them.",
         R"(
            x, y = vars "x y"
            at = dae{ der(x) ~ -x, 0 ~ x^2 + y^2 - 1 }:init{ fix = { x = 0.6 }, guess = { y = 1 } }
            return at:branches()[1].formula)",
         "y = ±√(1 - x²)"},
        {"start#fix", start_fix, "at.fix -> table", "The values that were fixed.", "", ""},
        {"start#guess", start_guess, "at.guess -> table", "The values that were only guessed.", "", ""},
        {"start#inputs", start_inputs, "at.inputs -> table", "The inputs that it was made with.", "", ""},
        {"start#params", start_params, "at.params -> table", "The parameter values that it was made with.",
         "", ""},
        {"start#t", start_time, "at.t -> number", "The time of the start.", "", ""},
        {"start:__tostring", start_text, "print(at)", "The ledger.", "", ""},
    }};

}  // namespace pendula::lua
