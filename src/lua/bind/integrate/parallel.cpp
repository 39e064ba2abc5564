// parallel_calls(n, f): a Lua function in worker processes. Reads arguments, calls src/integrate.
#include <algorithm>
#include <cstdio>
#include <numeric>

#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/sweep/workers.hpp"
#include "lua/bind/random/random.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {
namespace {

using integrate::SharedSlots;
constexpr double single = 0, list = 1;  ///< result of f: a number, a list

const OptionTable& parallel_option_rows() {
  static const OptionTable rows = {
      {"workers", "integer", "", "worker processes; 1: none. Without it one for each processor"},
      {"limit", "number", "", "seconds that one call may take; a longer one is a failure"},
      {"seed", "integer", "0", "of rand and randn in the calls: their numbers depend on seed and i only"},
      {"title", "string", "\"parallel_calls\"", "the first words of the progress line"},
  };
  return rows;
}

/// Calls f(i) and writes its result: kind, count, then the numbers.
void call_one(lua_State* L, int function, int i, std::uint64_t seed, std::size_t most, double* numbers) {
  ScriptNumbers& generator = script_numbers(L);
  const ScriptNumbers before = generator;
  generator = {seed, 0, static_cast<std::uint32_t>(i + 1)};
  lua_pushvalue(L, function);
  lua_pushinteger(L, i + 1);
  protected_call(L, 1, 1);
  generator = before;
  const bool one = lua_type(L, -1) == LUA_TNUMBER;
  Vec values(1);
  if (one)
    values[0] = lua_tonumber(L, -1);
  else
    values = to_numbers(L, lua_gettop(L), "what f returned");
  lua_pop(L, 1);
  if (static_cast<std::size_t>(values.size()) > most)
    throw Error(text("f returned ", values.size(), " numbers; at most ", most, " are taken from one call"));
  numbers[0] = static_cast<double>(values.size());
  numbers[1] = one ? single : list;
  std::copy(values.begin(), values.end(), numbers + 2);
}

void push_result(lua_State* L, const double* numbers) {
  if (numbers[1] == single) {
    lua_pushnumber(L, numbers[2]);
    return;
  }
  push_matrix(L, Mat(Eigen::Map<const Vec>(numbers + 2, static_cast<Eigen::Index>(numbers[0]))));
}

/// The largest number of values per result of n calls: 64 MB in total, but never less than 1024 values.
std::size_t most_numbers(long n) {
  return static_cast<std::size_t>(std::clamp(8'388'608L / n, 1024L, 1'048'576L));
}

/// Pushes the list of results, with false for missing ones, and the list of failures. Returns the number of
/// calls not made.
lua_Integer push_results(lua_State* L, const SharedSlots& slots) {
  lua_createtable(L, slots.tasks(), 0);
  lua_newtable(L);
  lua_Integer failures = 0, left = 0;
  for (int i = 0; i < slots.tasks(); ++i) {
    const auto state = slots.state(i);
    if (state == SharedSlots::State::done) {
      push_result(L, slots.numbers(i));
    } else {
      if (state == SharedSlots::State::failed) {
        const std::string why = slots.failure(i);
        lua_createtable(L, 0, 2);
        lua_pushinteger(L, i + 1);
        lua_setfield(L, -2, "index");
        lua_pushlstring(L, why.data(), why.size());
        lua_setfield(L, -2, "why");
        lua_rawseti(L, -2, ++failures);
      } else {
        ++left;
      }
      lua_pushboolean(L, false);
    }
    lua_rawseti(L, -3, i + 1);
  }
  return left;
}

int parallel(Call& call) {
  refuse_after_part();
  const long n = call.integer(1, "n");
  call.function(2, "f");
  const Options o = call.options(3);
  const long workers = o.integer("workers", integrate::available_workers());
  const double limit = o.number("limit", 0);
  if (n < 1 || n > 1'000'000) throw Error(text("n = ", n, "; it must lie between 1 and 1 000 000"));
  if (workers < 1 || workers > 1024)
    throw Error(text("workers = ", workers, "; the number of processes must lie between 1 and 1024"));
  if (o.has("limit") && !(limit > 0))
    throw Error(text("limit = ", shortest(limit), "; the seconds that one call may take must be positive"));
  const auto seed = static_cast<std::uint64_t>(o.integer("seed", 0));
  lua_State* L = call.L;
  std::vector<int> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  const std::size_t most = most_numbers(n);
  SharedSlots slots(std::move(all), most + 2);
  CountProgress progress(o.string("title", "parallel_calls"), "calls", static_cast<int>(n));
  const bool complete = integrate::run_tasks(
      slots, {static_cast<int>(std::min(workers, n)), limit, [&](int done) { progress(done); }},
      [&](int i, double* numbers) { call_one(L, 2, i, seed, most, numbers); });
  if (!complete) {
    const int level = level_of_prompt(L);
    if (level == 0 || slots.finished() == 0) throw Interrupted();
    keep_part(L, level);
    std::fprintf(stderr, "\ninterrupted; the calls that are done are the result\n");
  }
  lua_pushinteger(L, push_results(L, slots));
  return 3;
}

}  // namespace

extern const Module parallel_module = {
    "sweep",
    "",
    {
        {"parallel_calls", parallel,
         "parallel_calls(n, f [, { workers =, limit =, seed =, title = }]) -> results, failures, left",
         R"(Calls f(1) … f(n) in worker processes; f returns a number or a list of numbers. For fits from many starts,
            bootstrap, cross-validation, scans: rand and randn give each call numbers of its own, whoever makes it. A
            call that fails, crashes or takes longer than limit is false in the results and { index =, why = } in the
            failures. Assignments in f stay in its process. Ctrl-C at the prompt keeps the finished calls: `left` is the
            number of calls that were not made; they are false in the results.)",
         R"(
            squares, failures = parallel_calls(3, function(i) return i^2 end)
            print(squares[3], #failures))",
         "9.0 0", &parallel_option_rows()},
    }};

}  // namespace pendula::lua
