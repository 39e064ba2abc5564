// Reduced forms, their derivations, and their LaTeX. Reads arguments, calls src/dae.
#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/alias/eliminate.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/latex_lines.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/report/lua_source.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "mech/derivation.hpp"

namespace pendula::lua {

/// A derivation as a value: prints as text, has :latex() and the methods of a string.
struct Trace {
  dae::ModelPtr model;
  dae::Detail detail = dae::Detail::full;
  std::string text() const {
    const std::string derivation = mech::trace(model, detail, dae::Notation::text);
    return derivation.empty() ? "The model stands as it was written; nothing was derived."
                              : derivation.substr(0, derivation.size() - 1);
  }
  std::string latex() const {
    std::string derivation = mech::trace(model, detail, dae::Notation::latex);
    if (derivation.ends_with("\\\\\n"))
      derivation.resize(derivation.size() - 3);  // no line break after the last line
    return derivation.empty() ? text() : derivation;
  }
};
template <>
struct TypeName<Trace> {
  static constexpr const char* value = "trace";
};

namespace {

int reduce(Call& call) {
  lua_State* L = call.L;
  const dae::ModelPtr model = model_ptr(call);
  dae::ReduceOptions request;
  if (call.has(3)) {
    const Options o = call.options(3);
    for (const auto& [key, gain] : {std::pair{"alpha", &request.alpha}, std::pair{"beta", &request.beta}})
      if (o.has(key)) *gain = to_expr(L, o.push(key), key);
    if (o.has("at")) {
      const auto* held = object_at(L, o.push("at"), TypeName<dae::ConsistentState>::value);
      if (!held) throw Error("at must be a start: at = sys:init{ … }");
      request.at =
          translated(std::static_pointer_cast<const dae::ConsistentState>(*held), dae::original(model))
              ->values;
    }
    lua_settop(L, call.count());
  }
  return call.push(dae::reduce(model, call.string(2, "form", ""), request));
}

int eliminate(Call& call) {
  const dae::ModelPtr model = model_ptr(call);
  std::vector<Expr> zeros;
  if (call.has(2)) {
    const Options o = call.options(2);
    if (o.has("zero")) zeros = to_leaves(call.L, o.push("zero"), "zero", model->parameters);
  }
  return call.push(dae::eliminate(model, zeros));
}

dae::Detail detail_named(const std::string& name) {
  if (name == "short") return dae::Detail::brief;
  if (name == "full") return dae::Detail::full;
  if (name == "every step") return dae::Detail::every;
  const std::vector<std::string> names{"short", "full", "every step"};
  throw Error(text("unknown detail '", name, "'.", did_you_mean(name, names),
                   " A derivation is \"short\", \"full\" or \"every step\""));
}

const OptionTable trace_options = {
    {"1", "string", "\"full\"", "how much of the derivation is printed", "short|full|every step|latex"},
    {"detail", "string", "\"full\"", "the same in the table", "short|full|every step"},
    {"latex", "boolean", "false", "as a text in LaTeX"},
};

/// trace(), trace "short", trace("full", { latex = true }), trace { detail = "short" }, trace "latex".
int trace(Call& call) {
  collect_aliases(call.L);
  Trace derivation{model_ptr(call)};
  bool latex = false;
  const bool named = lua_type(call.L, 2) == LUA_TSTRING;
  if (named) {
    const std::string word = lua_tostring(call.L, 2);
    latex = word == "latex";
    if (!latex) derivation.detail = detail_named(word);
  }
  if (const int at = named || !call.has(2) ? 3 : 2; call.has(at)) {
    const Options o = call.options(at);
    latex = latex || o.boolean("latex", false);
    if (o.has("detail")) derivation.detail = detail_named(o.string("detail", ""));
  }
  return latex ? call.push(derivation.latex())
               : call.push(std::make_shared<const Trace>(std::move(derivation)));
}

int model_latex(Call& call) {
  collect_aliases(call.L);
  return call.push(dae::latex(*model_ptr(call)));
}

int model_code(Call& call) { return call.push(dae::code(model_ptr(call))); }

const Trace& trace_of(Call& call) {
  collect_aliases(call.L);
  return call.object<Trace>(1, "trace");
}

int trace_text(Call& call) { return call.push(trace_of(call).text()); }
int trace_latex(Call& call) { return call.push(trace_of(call).latex()); }

int trace_length(Call& call) {
  const std::string derivation = trace_of(call).text();
  return call.push(static_cast<long>(std::count(derivation.begin(), derivation.end(), '\n') + 1));
}

/// Applies the function of Lua's string library (find, match, gsub …) to the text of a derivation.
int string_function(Call& call, const char* name) {
  lua_State* L = call.L;
  const std::string derivation = trace_of(call).text();
  const int arguments = call.count();
  lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
  lua_getfield(L, -1, LUA_STRLIBNAME);
  lua_getfield(L, -1, name);
  const int function = lua_gettop(L);
  lua_pushlstring(L, derivation.data(), derivation.size());
  for (int i = 2; i <= arguments; ++i) lua_pushvalue(L, i);
  const bool calls_back = lua_isfunction(L, 3);  // gsub: errors of its callback have their own position
  try {
    protected_call(L, arguments, LUA_MULTRET);
  } catch (const LuaError& e) {
    if (calls_back) throw;
    throw Error(e.what());  // adds the position of this call, which string.find does not see
  }
  return lua_gettop(L) - function + 1;
}
int trace_find(Call& call) { return string_function(call, "find"); }
int trace_match(Call& call) { return string_function(call, "match"); }
int trace_gmatch(Call& call) { return string_function(call, "gmatch"); }
int trace_gsub(Call& call) { return string_function(call, "gsub"); }

const OptionTable eliminate_options = {
    {"zero", "list", "", "parameters, as symbols or by name"},
};

const OptionTable reduce_options = {
    {"1", "string", "", "the form; chosen if it is not given",
     "acc|ggl|baumgarte|project|dummy|minimal|ode|array"},
    {"alpha", "expression", "", "baumgarte: gain of C, in 1/s²"},
    {"beta", "expression", "", "baumgarte: gain of C′, in 1/s"},
    {"at", "start", "", "the point at which a choice is made (dummy, minimal, array): at = sys:init{ … }"},
};

}  // namespace

extern const Module forms_module = {
    "forms",
    "Reduced forms of a model",
    {
        {"model:eliminate", eliminate, "sys:eliminate([{ zero = { R, … } }]) -> model",
         R"(The same model without the unknowns that an equation defines: aliases x = ±y, constants, sums, and
            unknowns that are used once. Their values can still be asked for: sol(x). Exact: nothing that depends on time
            is divided by, and no solution is lost or gained. zero: parameters that are the number 0 from here
            on; their terms are removed.)",
         R"(x, y, z = vars "x y z"  return #dae{ der(x) ~ -y, y ~ 2*z, z ~ x }:eliminate().equations)", "1",
         &eliminate_options},
        {"model:reduce", reduce, "sys:reduce([form [, { alpha =, beta =, at = start }]]) -> model",
         R"(A model of lower index. "acc" differentiates constraints down to accelerations, "ode" solves
            these for x′ = f, "project" keeps the constraints by projection after every step, "baumgarte"
            lets violations decay (gains alpha, beta), "ggl" keeps C = 0 and C′ = 0 with additional
            multipliers (index 2), "dummy" makes dependent derivatives algebraic, chosen at a start,
            "minimal" substitutes dependent coordinates (of a quadratic constraint the root of the start
            at), "array" takes rows of the derivative array and needs nothing but an index. Without an argument, the
            form best suited to simulation; trace() says which and why.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):index())", "1",
         &reduce_options},
        {"model:trace", trace,
         R"(sys:trace(["short" | "full" | "every step"] [, { latex = true }]) -> trace)",
         R"(The derivation of this form, step by step: differentiations, combinations and substitutions, with
            the numbers of the equations; of a model made by lagrange, from the energies on: L, its partial
            derivatives, the generalised forces, W and c. "short" has the results, "full" (the default) the
            steps between them, "every step" all parts of them. print it, or take :latex(); :find and :match
            search its text.)",
         "x, z = vars \"x z\"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce(\"acc\"):trace():match "
         "\"^[^\\n]*\"",
         "(2)  0 = x - sin(t)   is differentiated once", &trace_options},
        {"model:latex", model_latex, "sys:latex() -> string", "The equations in LaTeX, with their numbers.",
         R"(x = var "x"  return dae{ der(x) ~ -2*x }:latex())",
         R"(
            \begin{align}
              \dot{x} &= -2 x \tag{1}
            \end{align})"},
        {"model:code", model_code, "sys:code() -> string",
         R"(Lua text that rebuilds the model with its parameter values and its lineage (reduce "form" …),
            also in a new session. save writes it.)",
         R"(x = var "x"  return dae{ der(x) ~ -2*x }:code())",
         R"(
            -- A model of Pendula.
            local x = var("x")
            return dae {
              der(x) ~ -2*x,
            })"},
        {"trace:latex", trace_latex, "trace:latex() -> string",
         "The derivation in LaTeX, a line for each step.", R"(
             x, z = vars "x z"
             dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace():latex())"},
        {"trace:find", trace_find, "trace:find(pattern [, from [, plain]]) -> integers",
         "Like string.find in the text of the derivation; match, gmatch and gsub work too.", R"(
             x, z = vars "x z"
             tr = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace()
             tr:find "index" ~= nil)",
         "true"},
        {"trace:match", trace_match, "trace:match(pattern) -> strings",
         "Like string.match in the text of the derivation.", R"(
             x, z = vars "x z"
             tr = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace()
             tr:match "[^\n]*")",
         "(2)  0 = x - sin(t)   is differentiated once"},
        {"trace:gmatch", trace_gmatch, "trace:gmatch(pattern) -> iterator",
         "Like string.gmatch in the text of the derivation.", R"(
             x, z = vars "x z"
             tr = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace()
             count = 0
             for line in tr:gmatch "[^\n]+" do count = count + 1 end
             count)",
         "8"},
        {"trace:gsub", trace_gsub, "trace:gsub(pattern, replacement) -> string",
         "Like string.gsub in the text of the derivation.",
         R"(
             x, z = vars "x z"
             tr = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace()
             print((tr:gsub("\n.*", " …"))))",
         "(2)  0 = x - sin(t)   is differentiated once …"},
        {"trace:__len", trace_length, "#trace", "The number of lines.", "", ""},
        {"trace:__tostring", trace_text, "print(sys:trace())", "The derivation as text.", "", ""},
    }};

}  // namespace pendula::lua
