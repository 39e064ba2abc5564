// The `lti` module: systems made from matrices, fractions and roots, and from one another.
// Reads arguments, calls src/lti.
#include <algorithm>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

using lti::System;

Expr read_sampling(lua_State* L, int index) {
  const Expr Ts = to_expr(L, index, "Ts");
  if (Ts.is_constant() && !(constant_value(Ts) > 0))
    throw Error(text("the sampling time must be positive, got Ts = ", to_text(Ts),
                     "; without it time is continuous"));
  return Ts;
}
Expr sampling_argument(Call& call, int i) { return call.has(i) ? read_sampling(call.L, i) : Expr(0); }

// ── ss ──

/// Takes a flat list as a row if its length fits.
MatX output_matrix(const MatX& C, Eigen::Index states) {
  return C.cols() == 1 && C.rows() == states && states != 1 ? MatX(C.transpose()) : C;
}

System state_space(const MatX& A, MatX B, MatX C, std::optional<MatX> D, Expr Ts) {
  if (B.cols() == 1 && A.rows() == 1 && B.rows() > 1) B = MatX(B.transpose());
  C = output_matrix(C, A.rows());
  MatX through = D ? *D : MatX(MatX::Zero(C.rows(), B.cols()));
  if (through.size() == 1 && through(0, 0).is_zero()) through = MatX::Zero(C.rows(), B.cols());
  if (through.cols() == 1 && C.rows() == 1 && through.rows() == B.cols() && B.cols() > 1)
    through = MatX(through.transpose());
  return lti::make_ss(A, B, C, through, Ts);
}

void name_channels(System& g, const Options& o, lua_State* L) {
  const auto read = [&](const char* key, std::size_t count, std::vector<std::string>& names) {
    if (!o.has(key)) return;
    names = read_names(L, o.push(key), key);
    lua_pop(L, 1);
    if (names.size() != count)
      throw Error(text("option '", key, "': expected ", count, count == 1 ? " name" : " names", ", got ",
                       names.size()));
  };
  read("states", static_cast<std::size_t>(g.ss.order()), g.state_names);
  read("inputs", static_cast<std::size_t>(g.inputs), g.input_names);
  read("outputs", static_cast<std::size_t>(g.outputs), g.output_names);
}

const OptionTable name_options = {
    {"states", "string or list of strings", "", "names of the states"},
    {"inputs", "string or list of strings", "", "names of the inputs"},
    {"outputs", "string or list of strings", "", "names of the outputs"},
};
const OptionTable ss_options = joined(
    {
        {"A", "matrix", "", "of x′ = A x + B u"},
        {"B", "matrix", "", "without it there are no inputs"},
        {"C", "matrix", "", "of y = C x + D u; without it the outputs are the states"},
        {"D", "matrix", "0", "the direct way from u to y"},
        {"Ts", "number", "0", "the sampling time, in s; 0: continuous"},
    },
    name_options);

System ss_from_options(Call& call) {
  lua_State* L = call.L;
  const Options o = call.options(1);
  const auto matrix = [&](const char* key) {
    const MatX m = to_matrix(L, o.push(key), key);
    lua_pop(L, 1);
    return m;
  };
  if (!o.has("A")) throw Error("expected { A =, B =, C =, D =, Ts = }: A is required");
  const MatX A = matrix("A");
  const MatX B = o.has("B") ? matrix("B") : MatX(MatX::Zero(A.rows(), 0));
  const MatX C = o.has("C") ? matrix("C") : MatX(MatX::Identity(A.cols(), A.cols()));
  Expr Ts = 0;
  if (o.has("Ts")) Ts = read_sampling(L, o.push("Ts"));
  lua_settop(L, call.count());
  System g = state_space(A, B, C, o.has("D") ? std::optional(matrix("D")) : std::nullopt, Ts);
  name_channels(g, o, L);
  return g;
}

bool has_string_key(lua_State* L, int i) {
  if (!lua_istable(L, i)) return false;
  lua_pushnil(L);
  if (!lua_next(L, i)) return false;
  const bool named = lua_type(L, -2) == LUA_TSTRING;
  lua_pop(L, 2);
  return named;
}

/// Rejects a model of equations: it becomes a linear system only at a point.
void refuse_model(Call& call) {
  if (object_type(call.L, 1) != "model") return;
  throw Error(text("a model becomes a linear system at a point: at = sys:init{ fix = … }, then G = ",
                   "sys:linearize(at), and G:tf() or G:zpk()"));
}

int ss(Call& call) {
  lua_State* L = call.L;
  refuse_model(call);
  if (call.is<System>(1)) return push_system(call, lti::to_ss(system_of(call)));
  if (has_string_key(L, 1)) return push_system(call, ss_from_options(call));
  if (call.count() == 1) return push_system(call, lti::make_gain(to_matrix(L, 1, "D")));
  const MatX A = to_matrix(L, 1, "A"), B = to_matrix(L, 2, "B");
  const MatX C = call.has(3) ? to_matrix(L, 3, "C") : MatX(MatX::Identity(A.cols(), A.cols()));
  const auto D = call.has(4) ? std::optional(to_matrix(L, 4, "D")) : std::nullopt;
  return push_system(call, state_space(A, B, C, D, sampling_argument(call, 5)));
}

// ── tf ──

lti::Polynomial read_polynomial(lua_State* L, int index, const std::string& what) {
  const VecX c = to_column(L, index, what);
  if (c.size() == 0) throw Error(text(what, " has no coefficients"));
  lti::Polynomial p;
  for (Eigen::Index k = c.size(); k-- > 0;) p.push_back(c[k]);
  return p;
}

/// The type of list[1], or LUA_TNIL.
int first_type(lua_State* L, int index, bool* system = nullptr) {
  if (!lua_istable(L, index)) return LUA_TNIL;
  const int type = lua_rawgeti(L, index, 1);
  if (system) *system = object_type(L, -1) == TypeName<System>::value;
  lua_pop(L, 1);
  return type;
}

/// { { {…}, {…} }, … }: a matrix of lists of coefficients
bool is_matrix_of_lists(lua_State* L, int index) {
  if (first_type(L, index) != LUA_TTABLE) return false;
  lua_rawgeti(L, index, 1);
  const bool nested = first_type(L, lua_gettop(L)) == LUA_TTABLE;
  lua_pop(L, 1);
  return nested;
}

/// Visits list[i][j]; the entry is on top of the stack.
template <class Visit>
std::pair<int, int> each_entry(lua_State* L, int index, const std::string& what, const Visit& visit) {
  const int rows = static_cast<int>(list_size(L, index, what));
  int cols = -1;
  for (int i = 1; i <= rows; ++i) {
    if (lua_rawgeti(L, index, i) != LUA_TTABLE)
      throw Error(text(what, "[", i, "] must be a list, not ", describe(L, -1)));
    const int row = lua_gettop(L), n = static_cast<int>(list_size(L, row, text(what, "[", i, "]")));
    if (cols >= 0 && n != cols)
      throw Error(text(what, "[", i, "] has ", n, " entries, the rows above have ", cols));
    cols = n;
    for (int j = 1; j <= n; ++j) {
      lua_rawgeti(L, row, j);
      visit(lua_gettop(L), text(what, "[", i, "][", j, "]"));
      lua_settop(L, row);
    }
    lua_settop(L, row - 1);
  }
  if (rows == 0 || cols <= 0) throw Error(text(what, " is empty"));
  return {rows, cols};
}

System tf_of_lists(Call& call) {
  lua_State* L = call.L;
  std::vector<lti::Fraction> entries;
  const auto [rows, cols] = each_entry(L, 1, "num", [&](int at, const std::string& what) {
    entries.push_back({read_polynomial(L, at, what), {1}});
  });
  if (call.has(2) && is_matrix_of_lists(L, 2)) {
    std::size_t k = 0;
    const auto size = each_entry(L, 2, "den", [&](int at, const std::string& what) {
      if (k < entries.size()) entries[k].den = read_polynomial(L, at, what);
      ++k;
    });
    if (size != std::pair(rows, cols))
      throw Error(text("num is a ", rows, "×", cols, " matrix of lists, den a ", size.first, "×", size.second,
                       " one"));
  } else if (call.has(2)) {
    const lti::Polynomial den = read_polynomial(L, 2, "den");
    for (auto& f : entries) f.den = den;
  }
  return lti::make_tf(std::move(entries), rows, cols, sampling_argument(call, 3));
}

System system_at(lua_State* L, int index, const std::string& what) {
  if (const auto* held = object_at(L, index, TypeName<System>::value); held && *held)
    return *static_cast<const System*>(held->get());
  return lti::make_gain(to_matrix(L, index, what));
}

bool is_matrix_of_systems(lua_State* L, int index) {
  if (!lua_istable(L, index)) return false;
  bool found = false;
  for (lua_Integer i = 1; !found && lua_rawgeti(L, index, i) == LUA_TTABLE; ++i) {
    const int row = lua_gettop(L);
    for (lua_Integer j = 1; !found && lua_rawgeti(L, row, j) != LUA_TNIL; ++j) {
      found = object_type(L, -1) == TypeName<System>::value;
      lua_settop(L, row);
    }
    lua_settop(L, row - 1);
  }
  lua_settop(L, index > 1 ? std::max(index, lua_gettop(L)) : lua_gettop(L));
  return found;
}

System assembled(lua_State* L, int index) {
  std::vector<std::vector<System>> blocks;
  each_entry(L, index, "G", [&](int at, const std::string& what) {
    const auto open = what.rfind('['), first = what.find('[');
    if (what.substr(open) == "[1]" && open != first) blocks.emplace_back();
    blocks.back().push_back(system_at(L, at, what));
  });
  return lti::assemble(blocks);
}

int tf(Call& call) {
  lua_State* L = call.L;
  refuse_model(call);
  if (call.is<System>(1)) return push_system(call, lti::to_tf(system_of(call)));
  if (lua_type(L, 1) == LUA_TSTRING &&
      (call.string(1, "variable") == "s" || call.string(1, "variable") == "z")) {
    const bool discrete = call.string(1, "variable") == "z";
    if (discrete && !call.has(2)) throw Error("z needs a sampling time: tf(\"z\", Ts)");
    if (!discrete && call.has(2)) throw Error("s belongs to continuous time; write tf(\"z\", Ts)");
    return push_system(call, lti::make_tf({{{0, 1}, {1}}}, 1, 1, sampling_argument(call, 2)));
  }
  const int top = lua_gettop(L);
  const bool systems = is_matrix_of_systems(L, 1);
  lua_settop(L, top);
  if (systems) return push_system(call, lti::to_tf(assembled(L, 1)));
  if (is_matrix_of_lists(L, 1)) return push_system(call, tf_of_lists(call));
  const auto is_symbol = [&](int i) { return call.is<Expr>(i) && call.object<Expr>(i, "s").is_symbol(); };
  if (call.is<Expr>(1) && (is_symbol(2) || !call.has(2))) {
    const Expr e = to_expr(L, 1, "G");
    Expr s = call.has(2) ? call.object<Expr>(2, "s") : Expr(0);
    if (!call.has(2))
      for (Expr leaf : leaves({&e, 1}))
        if (symbol_of(leaf).name == "s" || symbol_of(leaf).name == "z") s = leaf;
    if (s.is_zero() && !call.has(2)) return push_system(call, lti::make_tf({{{e}, {1}}}, 1, 1));
    if (lti::has_delay(e, s)) {
      lti::DelaySystem g = lti::delay_system_of(e, s);
      if (g.delays.empty()) return push_system(call, std::move(g.core));
      return call.push(std::make_shared<const lti::DelaySystem>(std::move(g)));
    }
    return push_system(call, lti::make_tf({lti::fraction_of(e, s)}, 1, 1, sampling_argument(call, 3)));
  }
  if (first_type(L, 1) == LUA_TTABLE)
    throw Error(
        "num is a list of lists; a matrix of transfer functions has lists of "
        "coefficients as entries: { { {1}, {1, 2} } }");
  lti::Fraction f{read_polynomial(L, 1, "num"),
                  call.has(2) ? read_polynomial(L, 2, "den") : lti::Polynomial{1}};
  return push_system(call, lti::make_tf({std::move(f)}, 1, 1, sampling_argument(call, 3)));
}

// ── zpk ──

std::vector<std::pair<Expr, Expr>> read_roots(lua_State* L, int index, const std::string& what) {
  std::vector<std::pair<Expr, Expr>> list;
  const auto add = [&](int at, const std::string& name) {
    const ComplexNumber z = read_complex(L, at, name);
    list.emplace_back(z.re, z.im);
  };
  if (const auto* held = object_at(L, index, TypeName<Roots>::value); held && *held) {
    for (const dae::Mode& m : static_cast<const Roots*>(held->get())->list)
      for (int k = 0; k < m.multiplicity; ++k)
        list.push_back(m.exact ? *m.exact : std::pair(Expr(m.value.real()), Expr(m.value.imag())));
  } else if (lua_istable(L, index)) {
    for (lua_Integer i = 1, n = list_size(L, index, what); i <= n; ++i) {
      lua_rawgeti(L, index, i);
      add(lua_gettop(L), text(what, "[", i, "]"));
      lua_settop(L, -2);
    }
  } else if (object_type(L, index) == TypeName<Matrix>::value) {
    const VecX column = to_column(L, index, what);
    for (Expr e : entries(column)) list.emplace_back(e, 0);
  } else {
    add(index, what);
  }
  return list;
}

int zpk(Call& call) {
  refuse_model(call);
  if (call.is<System>(1)) return push_system(call, lti::to_zpk(system_of(call)));
  lti::Factored f;
  f.zeros = read_roots(call.L, 1, "z");
  f.poles = read_roots(call.L, 2, "p");
  f.gain = call.has(3) ? to_expr(call.L, 3, "k") : Expr(1);
  return push_system(call, lti::make_zpk({std::move(f)}, 1, 1, sampling_argument(call, 4)));
}

// ── fields ──

int named(Call& call) {
  System g = system_of(call);
  name_channels(g, call.options(2), call.L);
  return push_system(call, std::move(g));
}

}  // namespace

extern const Module lti_construct_module = {
    "lti",
    "Linear systems",
    {
        {"ss", ss,
         R"(ss(A, B [, C [, D [, Ts]]]) or ss{ A =, B =, C =, D =, Ts =, states =, inputs =, outputs = } ->
            G)",
         R"(The state space x′ = A x + B u, y = C x + D u; with a sampling time Ts x⁺ = A x + B u. Without
            C the outputs are the states, without D it is zero. Entries stay exact or symbolic. ss(G)
            converts, ss(D) is a gain.)",
         "ss{ A = {{0, 1}, {-2, -3}}, B = {0, 1}, C = {1, 0} }",
         R"(
            state space: 2 states, 1 input, 1 output, continuous time
                   x₁  x₂ │ u
              x₁′   0   1 │ 0
              x₂′  -2  -3 │ 1
              ────────────┼──
              y     1   0 │ 0)",
         &ss_options},
        {"tf", tf, R"(tf(num, den [, Ts]) or tf(expression, s [, Ts]) or tf "s" -> G)",
         R"(A transfer function from coefficients, highest power first; a matrix of them from lists of
            lists of coefficients, or from a list of rows of systems. s = tf "s" (z = tf("z", Ts)) makes
            them by arithmetic; tf(G) converts.)",
         "tf({1, 2}, {1, 3, 1})",
         R"(
            transfer function, continuous time
                 s + 2
              ────────────
              s² + 3 s + 1)"},
        {"zpk", zpk, "zpk(zeros, poles, gain [, Ts]) -> G",
         R"(k Π (s - zᵢ)/Π (s - pᵢ); complex ones as complex(re, im) or { re, im }, in conjugate pairs.
            zpk(G) converts.)",
         "zpk({-1}, {{-1, 2}, {-1, -2}}, 3)",
         R"(
            zeros, poles, gain, continuous time
               3 (s + 1)
              ────────────
              s² + 2 s + 5)"},
        {"lti:tf", tf, "G:tf() -> G",
         "G(s) = C (sI - A)⁻¹B + D as fractions, exact; G.notes names cancelled factors.",
         "return ss({{0, 1}, {-2, -3}}, {0, 1}, {1, 0}):tf()(0)", "1/2"},
        {"lti:ss", ss, "G:ss() -> G",
         R"(A state space: of a fraction the controllable canonical form, of a matrix of fractions a
            minimal realisation.)",
         "G = tf({1}, {1, 1, 1})  return G:ss().A", R"(⎡ 0   1⎤
⎣-1  -1⎦)"},
        {"lti:zpk", zpk, "G:zpk() -> G", "The same as zeros, poles and gain.",
         "return tf({1}, {1, 3, 2}):zpk()", R"(zeros, poles, gain, continuous time
        1
  ──────────────
  (s + 2)(s + 1))"},
        {"lti:named", named, "G:named{ states =, inputs =, outputs = } -> G",
         "The same system with names for its signals.",
         "tf({1}, {1, 2}):ss():named{ states = {'v'}, inputs = {'F'}, outputs = {'y'} }.inputs[1]", "F",
         &name_options},
    }};

}  // namespace pendula::lua
