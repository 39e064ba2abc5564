// to_code: the text, and that Lua rebuilds the same node from it.
#include <doctest/doctest.h>

#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"
#include "lua/core/library.hpp"
#include "lua/core/values.hpp"
#include "lua/session/state.hpp"
#include "random_expressions.hpp"

namespace pendula::code_test {

namespace {

/// A Lua session that evaluates code.
class Session {
 public:
  Session() : L_(lua::new_state()) {}
  ~Session() { lua_close(L_); }
  /// "" where the code rebuilds e, the error text or what it built otherwise.
  std::string complaint(Expr e) {
    if (!run(to_code(e))) return lua_tostring(L_, -1);
    const Expr back = lua::to_expr(L_, -1, "code");
    return back == e ? "" : "built " + to_text(back) + " instead of " + to_text(e);
  }
  /// Keeps what only C++ refers to: it is given back between calls of the library (docs/decisions/019).
  Expr held(Expr e) {
    lua::push_expr(L_, e);
    luaL_ref(L_, LUA_REGISTRYINDEX);
    return e;
  }
  Expr rebuilt(Expr e) {
    REQUIRE(run(to_code(e)));
    return lua::to_expr(L_, -1, "code");
  }

 private:
  bool run(const std::string& code) {
    lua_settop(L_, 0);
    return luaL_loadstring(L_, ("return " + code).c_str()) == LUA_OK && lua::run(L_, 0, 1);
  }
  lua_State* L_;
};

}  // namespace

TEST_CASE("code: short expressions are one line") {
  const Expr x = symbol(Kind::variable, "x"), m = symbol(Kind::parameter, "m_code"),
             u = symbol(Kind::input, "u");
  const auto q = symbol_vector(Kind::variable, "q_code", 3);
  attributes(m).value = Expr(9.81);
  const std::pair<Expr, std::string> cases[] = {
      {derivative_leaf(x, 2) * 2, "2*der(var(\"x\"), 2)"},
      {m + u, "param(\"m_code\", 9.81) + input(\"u\")"},
      {derivative_leaf(q[1]) / 3, "der(var(\"q_code\", 3)[2])/3"},
      {x * Expr(mpq_class(1, 3)), "rational(\"1/3\")*var(\"x\")"},
      {sqrt(Expr(2)), "sqrt(rational(\"2\"))"},
      {Expr(0.5), "rational(\"1/2\")"},
      {-pow(x, 2), "-var(\"x\")^2"},
      {pow(-x, 3), "(-var(\"x\"))^3"},
      {x - (u - x), "var(\"x\") - (input(\"u\") - var(\"x\"))"},
      {ifelse(both(lt(x, 0), le(u, 1)), time_symbol(), pi()),
       "ifelse(all(lt(var(\"x\"), 0), le(input(\"u\"), 1)), t, pi)"},
  };
  for (const auto& [e, text] : cases) CHECK(to_code(e) == text);
}

TEST_CASE("code: Lua rebuilds the same expression") {
  Session session;
  const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");
  const auto p = symbol_vector(Kind::variable, "p_code", 3);
  const auto L = symbol_vector(Kind::parameter, "L_code", 2);
  for (Expr c : L) attributes(c).value = Expr(2.5);
  FunctionCall f{"g", {3, 1}, {0, 0, 0, 0}, {p[0], p[1], p[2], x * y}};
  const Expr application = call(f);
  f.partial = {0, 1, 0, 2};
  const Expr cases[] = {x,
                        Expr(0),
                        Expr(-3),
                        Expr(mpq_class("123456789012345678901234567890/11")),
                        Expr(std::sqrt(2.0)) * x,
                        Expr(1e-300) + x,
                        L[1] * derivative_leaf(p[2], 3),
                        pow(Expr(2), Expr(mpq_class(1, 3))),
                        Expr(3) + -x,
                        -x + Expr(3),
                        x / y / (x * y),
                        pow(pow(x, y), x),
                        either(lt(x, y), le(y, 1)),
                        min(x, max(y, 2)),
                        application,
                        call(f) * x};
  for (Expr e : cases) {
    CAPTURE(to_code(e));
    CHECK(session.complaint(e) == "");
  }
}

TEST_CASE("code: deep, shared and large expressions are rebuilt, in linear length") {
  Session session;
  const Expr x = symbol(Kind::variable, "x");
  Expr deep = x, shared = x, sum = x;
  for (int i = 0; i < 3000; ++i) deep = sin(deep + 1);
  for (int i = 0; i < 300; ++i) shared = shared * sin(shared) + shared;
  for (int i = 0; i < 20'000; ++i) sum = sum + symbol(Kind::variable, "cs" + std::to_string(i)) * Expr(i + 2);
  for (Expr e : {session.held(deep), session.held(shared), session.held(sum)}) {
    CHECK(session.complaint(e) == "");
    CHECK(to_code(e).size() < 60 * topological({&e, 1}).size());
  }
}

TEST_CASE("code: the solution of a linear system has the same value") {
  Session session;
  const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");
  MatX a(3, 3);
  a << x, y, 1, y, x * y + 5, 2, 1, 0, x + 3;
  VecX b(3);
  b << y, 1, x;
  const VecX solution = linear_solution(a, b);
  const Expr e = session.held(solution[0] * sin(solution[1]) + solution[2]);
  const Expr pair[] = {e, session.rebuilt(e)};
  const auto values = evaluate(pair, {{x, 0.7}, {y, -1.3}});
  CHECK(values[0] == doctest::Approx(values[1]).epsilon(1e-12));
}

TEST_CASE("code: random expressions are rebuilt") {
  Session session;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    CAPTURE(seed);
    const Expr e = session.held(RandomExpressions(seed).expression(3 + static_cast<int>(seed % 5)));
    CAPTURE(to_code(e));
    CHECK(session.complaint(e) == "");
  }
}

}  // namespace pendula::code_test
