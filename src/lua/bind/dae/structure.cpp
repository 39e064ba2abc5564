// structure(): the structural analysis as a value that prints. Reads arguments, calls
// src/dae/report/structure_report.
#include "dae/report/report_latex.hpp"
#include "dae/report/structure_report.hpp"

#include <cmath>
#include <limits>

#include "base/text.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

template <>
struct TypeName<dae::StructureReport> {
  static constexpr const char* value = "structure";
};

namespace {

const OptionTable structure_options = {
    {"at", "start", "", "a result of init: ranks are also checked there"},
};

int structure(Call& call) {
  if (const auto* held = object_at(call.L, 2, TypeName<dae::ConsistentState>::value))  // sys:structure(at)
    return call.push(std::make_shared<const dae::StructureReport>(dae::structure(
        call.shared<dae::Model>(1, "model"), std::static_pointer_cast<const dae::ConsistentState>(*held))));
  const Options o = call.options(2);
  dae::ConsistentStatePtr at;
  if (o.has("at")) {
    const auto* held = object_at(call.L, o.push("at"), TypeName<dae::ConsistentState>::value);
    if (!held) throw Error("at must be a result of init: at = sys:init{ fix = { … } }");
    at = std::static_pointer_cast<const dae::ConsistentState>(*held);
  }
  return call.push(
      std::make_shared<const dae::StructureReport>(dae::structure(call.shared<dae::Model>(1, "model"), at)));
}

const dae::StructureReport& report_of(Call& call) {
  return call.object<dae::StructureReport>(1, "structure");
}

/// Text of s.c, s.sigma and similar lists: entries in a line, nested lists below each other.
int list_text(lua_State* L) {
  std::string out;
  const auto n = static_cast<lua_Integer>(lua_rawlen(L, 1));
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(L, 1, i);
    const bool absent = lua_type(L, -1) == LUA_TNUMBER && std::isinf(lua_tonumber(L, -1));
    if (i > 1) out += lua_istable(L, -1) ? "\n" : "  ";
    out += absent ? "·" : luaL_tolstring(L, -1, nullptr);
    lua_settop(L, 1);
  }
  if (n == 0) out = "none";
  if (lua_getfield(L, 1, "equations") == LUA_TTABLE && lua_rawlen(L, -1) > 0 &&
      lua_getfield(L, 1, "unknowns") == LUA_TTABLE) {
    const int unknowns = lua_gettop(L), equations = unknowns - 1;
    const std::string names = luaL_tolstring(L, unknowns, nullptr);
    out = text(names, "  for  ", luaL_tolstring(L, equations, nullptr));
  }
  lua_pushlstring(L, out.data(), out.size());
  return 1;
}

void make_readable(lua_State* L) { make_printing_list(L, "pendula.list", guarded<list_text>); }

int push_integers(lua_State* L, const std::vector<int>& list) {
  lua_createtable(L, static_cast<int>(list.size()), 0);
  for (std::size_t i = 0; i < list.size(); ++i) {
    lua_pushinteger(L, list[i]);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  make_readable(L);
  return 1;
}

int c(Call& call) { return push_integers(call.L, report_of(call).analysis.offsets.c); }
int d(Call& call) { return push_integers(call.L, report_of(call).analysis.offsets.d); }

int sigma(Call& call) {
  const dae::StructureReport& s = report_of(call);
  const std::size_t n = s.model->variables.size();
  lua_createtable(call.L, static_cast<int>(s.analysis.sigma.size()), 0);
  for (std::size_t i = 0; i < s.analysis.sigma.size(); ++i) {
    lua_createtable(call.L, static_cast<int>(n), 0);
    for (std::size_t j = 0; j < n; ++j) {
      lua_pushnumber(call.L, -std::numeric_limits<double>::infinity());
      lua_rawseti(call.L, -2, static_cast<lua_Integer>(j + 1));
    }
    for (const dae::SignatureEntry& e : s.analysis.sigma[i]) {
      lua_pushinteger(call.L, e.order);
      lua_rawseti(call.L, -2, e.variable + 1);
    }
    make_readable(call.L);
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(i + 1));
  }
  make_readable(call.L);
  return 1;
}

int structural_index(Call& call) {
  const dae::StructureReport& s = report_of(call);
  return call.push(s.verdict == dae::Verdict::structurally_singular ? std::nullopt
                                                                    : std::optional(s.structural_index));
}
int structural_dof(Call& call) {
  const dae::StructureReport& s = report_of(call);
  return call.push(s.verdict == dae::Verdict::structurally_singular ? std::nullopt
                                                                    : std::optional(s.structural_dof));
}
int structure_index(Call& call) { return call.push(report_of(call).index); }
int structure_dof(Call& call) { return call.push(report_of(call).dof); }
int verdict(Call& call) { return call.push(dae::verdict_name(report_of(call).verdict)); }
int valid(Call& call) { return call.push(report_of(call).verdict == dae::Verdict::valid); }

int jacobian(Call& call) {
  const dae::StructureReport& s = report_of(call);
  constexpr Eigen::Index most = 300;  // a larger matrix would fill the memory with zeros
  if (s.verdict == dae::Verdict::structurally_singular) return call.push_nil();
  const auto n = static_cast<Eigen::Index>(s.model->variables.size());
  if (n > most)
    throw Error(text("the system Jacobian has ", n, " rows; it is written out up to ", most,
                     " (s.blocks lists the blocks)"));
  MatX J = MatX::Zero(n, n);
  for (const Entry& e : s.analysis.jacobian) J(e.row, e.column) = e.value;
  return push_matrix(call.L, J);
}

int gap(Call& call) {
  const auto& value = report_of(call).gap;
  return value ? call.push(*value) : call.push_nil();
}

int nonzero(Call& call) {
  lua_newtable(call.L);
  lua_Integer k = 0;
  for (const dae::DeterminantFactor& c : report_of(call).validity.conditions) {
    push_expr(call.L, c.factor);
    lua_rawseti(call.L, -2, ++k);
  }
  make_readable(call.L);
  return 1;
}

/// { equations = {"(1)", …}, unknowns = {x, …} }
void push_part(lua_State* L, const dae::Model& m, const dae::Part& part) {
  lua_createtable(L, 0, 2);
  lua_createtable(L, static_cast<int>(part.rows.size()), 0);
  for (std::size_t k = 0; k < part.rows.size(); ++k) {
    lua_pushstring(L, m.label(static_cast<std::size_t>(part.rows[k])).c_str());
    lua_rawseti(L, -2, static_cast<lua_Integer>(k + 1));
  }
  make_readable(L);
  lua_setfield(L, -2, "equations");
  lua_createtable(L, static_cast<int>(part.columns.size()), 0);
  for (std::size_t k = 0; k < part.columns.size(); ++k) {
    push_expr(L, m.variables[part.columns[k]].leaf);
    lua_rawseti(L, -2, static_cast<lua_Integer>(k + 1));
  }
  make_readable(L);
  lua_setfield(L, -2, "unknowns");
  make_readable(L);
}

int over(Call& call) {
  push_part(call.L, *report_of(call).model, report_of(call).blocks.over);
  return 1;
}

int under(Call& call) {
  push_part(call.L, *report_of(call).model, report_of(call).blocks.under);
  return 1;
}

int blocks(Call& call) {
  const dae::StructureReport& s = report_of(call);
  lua_createtable(call.L, static_cast<int>(s.blocks.square.size()), 0);
  for (std::size_t k = 0; k < s.blocks.square.size(); ++k) {
    push_part(call.L, *s.model, s.blocks.square[k]);
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k + 1));
  }
  make_readable(call.L);
  return 1;
}

int structure_latex(Call& call) {
  collect_aliases(call.L);
  return call.push(dae::latex(report_of(call)));
}
int structure_text(Call& call) {
  collect_aliases(call.L);
  return call.push(dae::describe(report_of(call)));
}

}  // namespace

extern const Module structure_module = {
    "structure",
    "Structural analysis",
    {
        {"model:structure", structure, "sys:structure([start] or { at = start }) -> structure",
         R"(Σ matrix, offsets, blocks, structural index, and whether they are confirmed: the rank of
            the system Jacobian, exactly, and numerically at a start.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:structure().verdict)", "valid",
         &structure_options},
        {"structure#sigma", sigma, "s.sigma -> list of rows",
         "σ_ij: highest derivative of unknown j in equation i, -inf where absent.", "", ""},
        {"structure#c", c, "s.c -> list", "How often every equation is differentiated.", "", ""},
        {"structure#d", d, "s.d -> list", "Highest derivative of every unknown after that.", "", ""},
        {"structure#structural_index", structural_index, "s.structural_index -> integer or nil",
         "The maximum of c, plus one if some d is 0.", "", ""},
        {"structure#structural_dof", structural_dof, "s.structural_dof -> integer or nil", "Σ d - Σ c.", "",
         ""},
        {"structure#index", structure_index, "s.index -> integer or nil",
         "The differentiation index where the analysis is valid.", "", ""},
        {"structure#dof", structure_dof, "s.dof -> integer or nil",
         "The number of free initial values where the analysis is valid.", "", ""},
        {"structure#verdict", verdict, "s.verdict -> string",
         R"("valid", "valid but singular at this point", "identically singular" or "structurally singular".)",
         "", ""},
        {"structure#valid", valid, "s.valid -> boolean", R"(Whether the verdict is "valid".)", "", ""},
        {"structure#J", jacobian, "s.J -> matrix or nil",
         "The system Jacobian J_ij = ∂F_i/∂x_j^(d_j - c_i), symbolic.",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - z^3 }:structure().J[2][2])", "3 z²"},
        {"structure#jacobian", jacobian, "s.jacobian -> matrix or nil", "The same as s.J.", "", ""},
        {"structure#gap", gap, "s.gap -> number or nil",
         "σ_min/σ_max of the scaled system Jacobian at the point given as at; 0 where it is singular.", "",
         ""},
        {"structure#nonzero", nonzero, "s.nonzero -> list of expressions",
         "Factors of det J: the structural answer holds where none of them vanishes.",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - z^3 }:structure().nonzero[1])", "z"},
        {"structure#over", over, "s.over -> { equations, unknowns }",
         "The over-determined part: more equations than unknowns.", "", ""},
        {"structure#under", under, "s.under -> { equations, unknowns }",
         "The under-determined part: more unknowns than equations.", "", ""},
        {"structure#blocks", blocks, "s.blocks -> list of { equations, unknowns }",
         "The square blocks, each solvable after those before it.", "", ""},
        {"structure:latex", structure_latex, "s:latex() -> string",
         "Σ, offsets and verdict in LaTeX: a fragment for amsmath; save \"x.tex\" makes a document of it.",
         R"(
             x, z = vars "x z"
             dae{ der(x) ~ z, 0 ~ x - sin(t) }:structure():latex())"},
        {"structure:__tostring", structure_text, "print(sys:structure())", "The whole report.", "", ""},
    }};

}  // namespace pendula::lua
