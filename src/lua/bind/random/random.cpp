// rand, randn, seed: random numbers of a script.
#include "lua/bind/random/random.hpp"

#include <cmath>

#include "base/text.hpp"
#include "random/special.hpp"

namespace pendula::lua {

namespace {
char numbers_key;
}  // namespace

ScriptNumbers& script_numbers(lua_State* L) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &numbers_key) != LUA_TUSERDATA) {
    lua_pop(L, 1);
    new (lua_newuserdatauv(L, sizeof(ScriptNumbers), 0)) ScriptNumbers;
    lua_pushvalue(L, -1);
    lua_rawsetp(L, LUA_REGISTRYINDEX, &numbers_key);
  }
  auto* numbers = static_cast<ScriptNumbers*>(lua_touserdata(L, -1));
  lua_pop(L, 1);
  return *numbers;
}

double next_uniform(ScriptNumbers& n) {
  return random::uniform_at({n.seed, random::Use::script, n.next++, n.series});
}

namespace {

constexpr long most_numbers = 100'000'000;

/// A number, a column of argument 1 or a matrix of arguments 1 and 2.
int push_numbers(Call& call, double (*make)(ScriptNumbers&)) {
  ScriptNumbers& numbers = script_numbers(call.L);
  if (!call.has(1)) return call.push(make(numbers));
  const long rows = call.integer(1, "n"), cols = call.integer(2, "m", 1);
  if (rows < 0 || cols < 0) throw Error(text("a matrix cannot have ", rows, " rows and ", cols, " columns"));
  if (rows > most_numbers || cols > most_numbers || rows * cols > most_numbers)
    throw Error("more than 100 000 000 numbers; make them in parts");
  Mat m(rows, cols);
  for (double& x : m.reshaped<Eigen::RowMajor>()) x = make(numbers);
  return push_matrix(call.L, m);
}

double next_normal(ScriptNumbers& numbers) { return random::normal_quantile(next_uniform(numbers)); }

int rand(Call& call) { return push_numbers(call, next_uniform); }
int randn(Call& call) { return push_numbers(call, next_normal); }

int seed(Call& call) {
  script_numbers(call.L) = {static_cast<std::uint64_t>(call.integer(1, "seed")), 0, 0};
  return 0;
}

}  // namespace

extern const Module random_module = {
    "random",
    "Random numbers and distributions",
    {
        {"rand", rand, "rand([n [, m]]) -> number or matrix",
         R"(Random numbers, uniform between 0 and 1 (both excluded): one, a column of n, or an n×m matrix. The
            sequence is the same in every session, and begins anew with seed(k).)",
         "seed(1)\nprint((\"%.6f\"):format(rand()))", "0.978803"},
        {"randn", randn, "randn([n [, m]]) -> number or matrix",
         "Normal random numbers of mean 0 and variance 1: one, a column of n, or an n×m matrix.",
         "seed(1)\nprint(#randn(3))", "3"},
        {"seed", seed, "seed(k)",
         R"(Begins sequence k of rand and randn, k an integer (sequence 1 at the start of a session). Generator:
            Philox4x32-10.)",
         "seed(7)\na = rand()\nseed(7)\nprint(a == rand())", "true"},
    }};

}  // namespace pendula::lua
