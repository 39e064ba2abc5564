// The `rk` table and the type "tableau". Reads arguments, calls src/integrate.
#include "lua/bind/integrate/tableau.hpp"
#include "base/text.hpp"
#include "lua/core/library.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "method/collocation.hpp"
#include "method/tableau_text.hpp"

namespace pendula::lua {

Expr read_entry(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) != LUA_TSTRING) return to_expr(L, index, what);
  try {
    return integrate::parse_entry(lua_tostring(L, index));
  } catch (const Error& error) {
    throw Error(text(what, ": ", error.what()));
  }
}

VecX read_list(lua_State* L, int index, const std::string& what) {
  if (!lua_istable(L, index)) return to_column(L, index, what);
  const int list = lua_absindex(L, index);
  VecX result(static_cast<Eigen::Index>(list_size(L, list, what)));
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    lua_geti(L, list, static_cast<lua_Integer>(i) + 1);
    result[i] = read_entry(L, -1, text(what, "[", i + 1, "]"));
    lua_pop(L, 1);
  }
  return result;
}

MatX read_rows(lua_State* L, int index, const std::string& what, Eigen::Index rows, Eigen::Index columns) {
  if (!lua_istable(L, index)) return to_matrix(L, index, what);
  const int list = lua_absindex(L, index);
  const auto size = static_cast<Eigen::Index>(list_size(L, list, what));
  if (rows >= 0 && size != rows)
    throw Error(text(what, " has ", size, size == 1 ? " row" : " rows", ", not ", rows));
  MatX M = MatX::Constant(size, columns < 0 ? size : columns, Expr());
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::string place = text("row ", i + 1, " of ", what);
    if (lua_geti(L, list, static_cast<lua_Integer>(i) + 1) != LUA_TTABLE) {
      throw Error(text(place, " must be a list of numbers, got ", describe(L, -1)));
    }
    const VecX row = read_list(L, -1, place);
    if (row.size() > M.cols()) {
      throw Error(
          text(place, " has ", row.size(), " entries for ", M.cols(), M.cols() == 1 ? " stage" : " stages"));
    }
    M.row(i).head(row.size()) = row.transpose();
    lua_pop(L, 1);
  }
  return M;
}

namespace {

using integrate::Tableau;

const Tableau& tableau_of(Call& call) { return call.object<Tableau>(1, "tableau"); }

int push_new(Call& call, Tableau tableau) {
  return call.push(std::make_shared<const Tableau>(std::move(tableau)));
}

/// dense = { order =, b = { {coefficients of θ, θ², …}, … }, c =, A = } (c and A of the extra stages).
integrate::DenseData read_dense(lua_State* L, int index, Eigen::Index s) {
  if (!lua_istable(L, index)) throw Error("dense must be a table { b = { {…}, … }, order = }");
  integrate::DenseData dense;
  if (lua_getfield(L, index, "order") != LUA_TNIL)
    dense.order = static_cast<int>(to_number(L, -1, "dense.order"));
  if (lua_getfield(L, index, "c") != LUA_TNIL) dense.c = read_list(L, -1, "dense.c");
  const Eigen::Index extra = dense.c.size();
  dense.A = MatX::Constant(extra, s + extra, Expr());
  if (lua_getfield(L, index, "A") == LUA_TTABLE) dense.A = read_rows(L, -1, "dense.A", extra, s + extra);
  if (lua_getfield(L, index, "b") != LUA_TTABLE) throw Error("dense.b must be a list of lists");
  Eigen::Index degree = 0;
  for (lua_Integer i = 1; lua_geti(L, -1, i) == LUA_TTABLE; ++i) {
    degree = std::max(degree, static_cast<Eigen::Index>(lua_rawlen(L, -1)));
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
  dense.b = read_rows(L, -1, "dense.b", s + extra, degree);
  lua_pop(L, 4);
  return dense;
}

/// Rejects shortened rows of A unless all rows stay within the lower triangle; otherwise their
/// meaning is ambiguous.
void refuse_ragged(lua_State* L, int index) {
  if (!lua_istable(L, index)) return;
  const auto s = static_cast<lua_Integer>(lua_rawlen(L, index));
  lua_Integer wide = 0, narrow = 0;
  std::size_t widest = 0, narrowest = 0;
  for (lua_Integer i = 1; i <= s; ++i) {
    lua_geti(L, index, i);
    const std::size_t size = lua_istable(L, -1) ? lua_rawlen(L, -1) : static_cast<std::size_t>(s);
    if (size > static_cast<std::size_t>(s)) return;  // an error of its own
    if (size > static_cast<std::size_t>(i) && !wide) {
      wide = i;
      widest = size;
    }
    if (size < static_cast<std::size_t>(s) && !narrow) {
      narrow = i;
      narrowest = size;
    }
    lua_pop(L, 1);
  }
  if (!wide || !narrow) return;
  throw Error(text("row ", narrow, " of A has ", narrowest, narrowest == 1 ? " entry" : " entries", ", row ",
                   wide, " has ", widest, ": rows may stop early only when A is lower triangular"));
}

integrate::TableauData read_fields(Call& call) {
  const Options options = call.options(1);
  if (!options.has("A") || !options.has("b"))
    throw Error("expected { A = { {…}, … }, b = {…}, c = {…} }: A and b are required");
  integrate::TableauData data;
  data.name = options.string("name", data.name);
  data.text = options.string("text", "");
  data.cite = options.string("cite", "");
  if (options.has("order")) data.order = static_cast<int>(options.integer("order", 0));
  if (options.has("embedded")) data.embedded = static_cast<int>(options.integer("embedded", 0));
  data.proved = options.boolean("proved", false);
  const int A_index = options.push("A");
  refuse_ragged(call.L, A_index);
  data.A = read_rows(call.L, A_index, "A", -1, -1);
  data.b = read_list(call.L, options.push("b"), "b");
  if (options.has("c")) data.c = read_list(call.L, options.push("c"), "c");
  if (options.has("bhat")) data.bhat = read_list(call.L, options.push("bhat"), "bhat");
  if (options.has("bhat2")) data.bhat2 = read_list(call.L, options.push("bhat2"), "bhat2");
  data.error_scale = options.number("error_scale", 1);
  if (options.has("dense")) data.dense = read_dense(call.L, options.push("dense"), data.A.rows());
  lua_settop(call.L, call.count());
  return data;
}

/// Are there symbols among the coefficients? Then order and stability are
/// algebraic questions (stdlib/tableaus/symbolic.lua).
bool has_symbols(const integrate::TableauData& data) {
  std::vector<Expr> all(entries(data.A).begin(), entries(data.A).end());
  all.insert(all.end(), data.b.begin(), data.b.end());
  if (data.c) all.insert(all.end(), data.c->begin(), data.c->end());
  const auto inside = leaves(all);
  return std::any_of(inside.begin(), inside.end(),
                     [](Expr e) { return symbol_of(e).kind != Kind::constant; });
}

int make(Call& call) {
  if (!lua_isstring(call.L, 1)) {
    call.table(1, "tableau");
    call.options(1);
    if (has_symbols(read_fields(call))) {
      push_named(call.L, "symbolic_tableau");
      lua_pushvalue(call.L, 1);
      protected_call(call.L, 1, 1);
      return 1;
    }
  }
  integrate::TableauData data =
      lua_isstring(call.L, 1) ? integrate::parse_tableau(call.string(1, "tableau")) : read_fields(call);
  try {
    return push_new(call, Tableau(std::move(data)));
  } catch (const Error& error) {  // begins with "tableau 'name'" already
    throw LuaError(user_position(call.L) + error.what());
  }
}

int gauss(Call& call) { return push_new(call, integrate::gauss(call.integer(1, "stages"))); }
int radau(Call& call) { return push_new(call, integrate::radau(call.integer(1, "stages"))); }
int radau_ia(Call& call) { return push_new(call, integrate::radau_ia(call.integer(1, "stages"))); }
int lobatto(Call& call) {
  return push_new(call, integrate::lobatto(call.string(1, "kind"), call.integer(2, "stages")));
}
int collocation(Call& call) {
  const VecX nodes = read_list(call.L, 1, "nodes");
  return push_new(call, integrate::collocation(entries(nodes)));
}

/// Pushes exact entries if all are exact, otherwise a matrix of doubles, which is not interned in
/// the expression graph.
template <class Exact, class Numeric>
int push_entries(Call& call, const Exact& exact_entries, const Numeric& numeric) {
  for (Eigen::Index i = 0; i < exact_entries.size(); ++i) {
    const Expr e = exact_entries.data()[i];
    if (e.is_constant() && !exact_value(e)) return push_matrix(call.L, Mat(numeric));
  }
  return push_matrix(call.L, MatX(exact_entries));
}

int A(Call& call) { return push_entries(call, tableau_of(call).data().A, tableau_of(call).A()); }
int b(Call& call) { return push_entries(call, tableau_of(call).data().b, tableau_of(call).b()); }
int c(Call& call) { return push_entries(call, *tableau_of(call).data().c, tableau_of(call).c()); }
int bhat(Call& call) {
  const Tableau& tab = tableau_of(call);
  if (tab.bhat()) return push_entries(call, *tab.data().bhat, *tab.bhat());
  return call.push_nil();
}

int bhat2(Call& call) {
  const Tableau& tab = tableau_of(call);
  if (tab.bhat2()) return push_entries(call, *tab.data().bhat2, *tab.bhat2());
  return call.push_nil();
}

int error_scale(Call& call) { return call.push(tableau_of(call).data().error_scale); }
int name(Call& call) { return call.push(tableau_of(call).name()); }
int tableau_note(Call& call) { return call.push(tableau_of(call).data().text); }
int cite(Call& call) { return call.push(tableau_of(call).data().cite); }
int stages(Call& call) { return call.push(tableau_of(call).stages()); }
int tableau_order(Call& call) { return call.push(tableau_of(call).order()); }
int proved(Call& call) { return push_new(call, tableau_of(call).proved()); }
int stage_order(Call& call) { return call.push(tableau_of(call).stage_order()); }
int is(Call& call) { return call.push(tableau_of(call).is(call.string(2, "property"))); }
int latex(Call& call) { return call.push(tableau_of(call).latex()); }
int drawn(Call& call) {
  const std::string text = tableau_of(call).str();
  return call.push(text.substr(0, text.size() - 1));
}

const OptionTable tableau_options = {
    {"A", "list of lists", "", "the matrix; fractions as strings: \"1/2\""},
    {"b", "list", "", "the weights"},
    {"c", "list", "", "the nodes; without it the row sums of A"},
    {"bhat", "list", "", "weights of the embedded method"},
    {"bhat2", "list", "", "weights of a second embedded method"},
    {"error_scale", "number", "1", "the error of a step is this factor times b - bhat"},
    {"dense", "list of lists", "", "coefficients of the dense output"},
    {"name", "string", "", "as it appears in print and stats()"},
    {"text", "string", "", "one sentence about it"},
    {"cite", "string", "", "where it was published"},
    {"order", "integer", "", "the order, where conditions are not to be checked"},
    {"embedded", "integer", "", "the order of bhat"},
    {"proved", "boolean", "false", "true: the declared order is proved elsewhere"},
};

}  // namespace

extern const Module tableau_module = {
    "rk",
    "Butcher tableaus",
    {
        {"tableau", make,
         "tableau{ A =, b =, c =, bhat =, name =, order = } or tableau [[ drawing ]] -> tableau",
         R"(A Runge-Kutta method from its coefficients, as a table or drawn with one line 'c | a a …' per
            stage and a last line '| b b …'. Entries are numbers or strings such as "sqrt(3)/6"; c defaults
            to the row sums of A. An order that is claimed is proved.)",
         R"(
            midpoint = tableau{ A = { {}, {"1/2"} }, b = {0, 1} }
            drawn = tableau [[ 0   |
            1/2 | 1/2
                | 0  1 ]]
            midpoint:order(), drawn:order())",
         "2 2", &tableau_options},
        {"rk.gauss", gauss, "rk.gauss(stages) -> tableau",
         R"(Gauss-Legendre collocation of order 2s: the nodes are the zeros of the shifted Legendre
            polynomial.)",
         "rk.gauss(2)",
         R"(
            gauss(2): 2 stages, order 4, fully implicit

            1/2 - √3/6 │ 1/4         1/4 - √3/6
            1/2 + √3/6 │ 1/4 + √3/6  1/4
            ───────────┼───────────────────────
                       │ 1/2         1/2)"},
        {"rk.radau", radau, "rk.radau(stages) -> tableau",
         "Radau IIA collocation of order 2s - 1: stiffly accurate, L-stable, good for DAEs.",
         "rk.radau(3):order()", "5"},
        {"rk.radau_iia", radau, "rk.radau_iia(stages) -> tableau", "The same as rk.radau(stages).",
         "rk.radau_iia(2):order()", "3"},
        {"rk.radau_ia", radau_ia, "rk.radau_ia(stages) -> tableau",
         "Radau IA, order 2s - 1: L-stable, the first node is 0.", "rk.radau_ia(2):order()", "3"},
        {"rk.lobatto", lobatto, "rk.lobatto(kind, stages) -> tableau",
         R"(Lobatto methods of order 2s - 2; kind is "IIIA", "IIIB", "IIIC", "IIIC*", "IIID" or "IIIE".)",
         R"(rk.lobatto("IIIC", 3):order())", "4"},
        {"rk.collocation", collocation, "rk.collocation{ node, … } -> tableau",
         "The collocation method with these nodes, in units of the step.",
         R"(rk.collocation{ "1/3", 1 }:order())", "3"},
        {"tableau#A", A, "tab.A -> matrix", "The coefficients aᵢⱼ.", "", ""},
        {"tableau#b", b, "tab.b -> column", "The weights.", "", ""},
        {"tableau#c", c, "tab.c -> column", "The nodes.", "", ""},
        {"tableau#bhat", bhat, "tab.bhat -> column or nil", "The weights of the embedded method.", "", ""},
        {"tableau#bhat2", bhat2, "tab.bhat2 -> column or nil",
         "The weights of a second embedded method (dop853).", "", ""},
        {"tableau#error_scale", error_scale, "tab.error_scale -> number",
         "The factor by which b - bhat is multiplied to estimate the error of a step.",
         "rk.verner87.error_scale", "8.0"},
        {"tableau#name", name, "tab.name -> string", "The name of the method.", "", ""},
        {"tableau#text", tableau_note, "tab.text -> string", "The use of the method.", "", ""},
        {"tableau#cite", cite, "tab.cite -> string", "Where the method comes from.", "", ""},
        {"tableau#stages", stages, "tab.stages -> integer", "The number of stages s.", "", ""},
        {"tableau:order", tableau_order, "tab:order() -> integer",
         "The order, decided from the coefficients by simplifying assumptions and rooted trees.",
         "return rk.gauss(3):order()", "6"},
        {"tableau:proved", proved, "tab:proved() -> tableau",
         R"(The same tableau with its claims (order, embedded order, order of the dense output) proved once
            more: those of the methods that come with the program are proved by its tests, not at every
            start.)",
         "rk.dop853:proved():order()", "8"},
        {"tableau:stage_order", stage_order, "tab:stage_order() -> integer",
         "The largest q with C(q) and B(q): the order of each stage.", "return rk.gauss(3):stage_order()",
         "3"},
        {"tableau:is", is, "tab:is(property) -> boolean",
         R"("explicit", "implicit", "diagonally implicit", "singly diagonally implicit", "FSAL", "stiffly
            accurate", "collocation", "A-stable", "A(α)-stable", "L-stable", "I-stable", "algebraically
            stable", "symplectic" or "symmetric".)",
         R"(rk.gauss(3):is "symplectic")", "true"},
        {"tableau:latex", latex, "tab:latex() -> string", "The tableau as a LaTeX array.",
         "return rk.midpoint:latex()", R"(\begin{array}{c|cc}
0 &  &  \\
\frac{1}{2} & \frac{1}{2} &  \\
\hline
 & 0 & 1
\end{array})"},
        {"tableau:__tostring", drawn, "print(tab)", "The tableau as a book draws it.", "", ""},
    }};

}  // namespace pendula::lua
