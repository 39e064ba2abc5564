// What a hostile or careless script may try on the infrastructure. Each line must end in the stated error (or
// value), and the session must still answer afterwards.
#include <doctest/doctest.h>

#include <csignal>
#include <ctime>
#include <thread>

#include <pthread.h>

#include "base/interrupt.hpp"
#include "lua/core/memory.hpp"
#include "widgets.hpp"

namespace pendula::malice_test {

using lua::Session;

namespace {

struct Attempt {
  const char* script;
  const char* expected;  ///< plain text found in the outcome
};

void attack(const std::vector<Attempt>& attempts) {
  Session session;
  lua::set_memory_cap(session.L, size_t{256} << 20);
  for (const Attempt& attempt : attempts) {
    const std::string script = attempt.script;
    CAPTURE(script);
    const std::string outcome = session(attempt.script);
    CAPTURE(outcome);
    CHECK(outcome.find(attempt.expected) != std::string::npos);
    CHECK(session("return widget(20):size() + 1") == "21.0");
  }
}

extern "C" void on_signal(int) { request_interrupt(); }

/// Runs the script and presses Ctrl-C, as a signal on this thread, after 30 ms.
std::string interrupted_run(Session& session, const std::string& script) {
  struct sigaction action = {}, before = {};
  action.sa_handler = on_signal;
  sigaction(SIGUSR1, &action, &before);
  const pthread_t self = pthread_self();
  std::thread presses([self] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    pthread_kill(self, SIGUSR1);
  });
  const std::string outcome = session(script);
  presses.join();
  sigaction(SIGUSR1, &before, nullptr);
  interrupt_requested = false;
  return outcome;
}

}  // namespace

TEST_CASE("malice: recursion without end") {
  attack({
      {"local function f() return 1 + f() end f()", "stack overflow"},
      {"local t = setmetatable({}, {}) getmetatable(t).__index = function(_, k) return t[k] end return t.x",
       "C stack overflow"},
      {"local t = setmetatable({}, { __tostring = function(self) return tostring(self) end }) return "
       "tostring(t)",
       "C stack overflow"},
      {"local function f() call_back(f) end f()", "C stack overflow"},
      {"local function f() return pcall(f) end f() error 'done'", "done"},
      {"local function f() coroutine.wrap(f)() end f()", "C stack overflow"},
      {"local function f() return ('x'):gsub('x', f) end f()", "C stack overflow"},
      {"local function f(a, b) table.sort({3, 2, 1}, f) return true end f()", "C stack overflow"},
      {"return load(('('):rep(1e5) .. '1')()", "attempt to call a nil value"},
      {"local ok, why = load(('('):rep(1e5) .. '1') return why", "overflow"},
      {"local ok, why = load('return ' .. ('{'):rep(1e5)) return why", "overflow"},
      {"local s = ('a'):rep(3e5) return s:find(('(a?)'):rep(40))", "too many captures"},
      {"return ('x'):rep(3e5):match(('.-'):rep(3e5) .. 'y')", "pattern too complex"},
      {"local t = {} for i = 1, 1e5 do t = { t } end return expect(t):equals({})", "expected"},
      {"local t = {} t[1] = t expect(t):near(t, 1)", "nested too deeply"},
      {"error(setmetatable({}, { __tostring = function(self) error(self) end }))", "__tostring fails"},
      {"local function f() error(setmetatable({}, { __tostring = f })) end f()", "__tostring fails"},
      {"xpcall(error, function(e) error(e) end) return 'survived'", "survived"},
  });
}

TEST_CASE("malice: sizes without measure") {
  attack({
      {"return ('x'):rep(1 << 40)", "resulting string too large"},
      {"return ('x'):rep(1 << 30)", "user.lua:1: not enough memory"},
      {"return ('x'):rep(math.maxinteger)", "resulting string too large"},
      {"return pcall(string.rep, 'x', 1 << 40)", "false"},
      {"return table.unpack({}, 1, 1e8)", "too many results to unpack"},
      {"return widget(table.unpack({}, 1, 1e6))", "too many results to unpack"},
      {"return arguments(table.unpack({}, 1, 2e5))", "expected an integer, got nil"},
      {"return table.concat({}, 'x', 1, 1e9)", "invalid value"},
      {"return string.format('%1000d', 1)", "invalid conversion"},
      {"return string.format('%99.99f', 1e308):len()", "409"},
      {"return utf8.char(1 << 40)", "value out of range"},
      {"return ('x'):rep(100, ('y'):rep(1 << 22)):len()", "not enough memory"},
      {"return select(-1 << 62, 1)", "index out of range"},
      {"return coroutine.resume(coroutine.create(function(...) return ... end), table.unpack({}, 1, 9e5))",
       "false"},
  });
}

TEST_CASE("malice: bytecode and the debug library") {
  attack({
      {"return load('\\27Lua')", "nil"},
      {"return select(2, load('\\27Lua'))", "attempt to load a binary chunk"},
      {"return load('\\27Lua', 'x', 'b')", "bytecode is not accepted"},
      {"return select(2, load('\\27Lua', 'x', 'bt'))", "attempt to load a binary chunk"},
      {"return load(function() return nil end, 'x', 'b')", "bytecode is not accepted"},
      {"return loadfile('/dev/null', 'b')", "bytecode is not accepted"},
      {"return load('return 7')()", "7"},
      {"return load('x = 7', 'n', 't', {})() == nil", "true"},
      {"return select(2, load('return y', 'n', 't', nil)) == nil", "true"},
      {"return string.dump(print)", "attempt to call a nil value (field 'dump')"},
      {"return debug.getregistry()", "attempt to call a nil value"},
      {"return debug.setmetatable(1, {})", "attempt to call a nil value"},
      {"return debug.getmetatable(widget(1))", "attempt to call a nil value"},
      {"return debug.setupvalue(print, 1, 2)", "attempt to call a nil value"},
      {"return debug.upvaluejoin(print, 1, print, 1)", "attempt to call a nil value"},
      {"return require('debug').sethook(print)", "attempt to call a nil value"},
      {"return package.loadlib('libc.so.6', '*')", "attempt to call a nil value"},
      {"return require 'nothing_here'", "module 'nothing_here' not found"},
      {"package.path = 3 + 0.5 return require 'x'", "must be a string"},
      {"package.path = {} return require 'x'", "must be a string"},
      {"package.path = './?.lua' return type(debug.traceback())", "string"},
      {"return debug.getinfo(1, 'l').currentline", "1"},
  });
}

TEST_CASE("malice: metatables") {
  attack({
      {"return setmetatable(widget(1), {})", "table expected"},
      {"getmetatable(widget(1)).__gc = nil", "attempt to index a string value"},
      {"return getmetatable('').__index", "nil"},
      {"setmetatable(_G, {})", "protected metatable"},
      {"setmetatable(pendula, {})", "protected metatable"},
      {"setmetatable(gears, nil)", "protected metatable"},
      {"return rawset(widget(1), 1, 2)", "table expected"},
      {"return rawlen(widget(1))", "table or string expected"},
      {"return #widget(1)", "attempt to get length"},
      {"return widget(1) < widget(2)", "attempt to compare"},
      {"return -widget(1)", "arithmetic"},
      {"for k in pairs(widget(1)) do end", "for iterator"},
      {"return next(widget(1))", "table expected"},
      {"return ('x'):bad()", "attempt to call a nil value (method 'bad')"},
      {"return widget.x", "attempt to index a function value"},
      {"local w = widget return w.size(io.stdout)", "attempt to index a function"},
      {"local size = widget(1).size return size(io.stdout)",
       "expected a widget before the colon, got a file"},
      {"local size = widget(1).size return size()", "got nothing"},
      {"local size = widget(1).size return size(setmetatable({}, { __name = 'widget' }))", "got a table"},
      {"local size = widget(1).size return size(setmetatable({}, { __index = widget(1) }))", "got a table"},
      {"configure(setmetatable({}, { __index = function() error 'called' end, __pairs = error }))", "ok"},
      {"local o = setmetatable({}, { __name = 3 }) widget(o)", "expected a number, got a table"},
      {"_G._G = nil; _ENV = nil; return 1", "1"},
      {"local _ENV = {}; return x", "nil"},
  });
}

TEST_CASE("malice: finalizers that bring the dead back") {
  attack({
      {"saved = nil do local w = widget(1) setmetatable({ w }, { __gc = function(t) saved = t[1] end }) end "
       "collectgarbage() collectgarbage() return saved:size()",
       ""},
      {"graves = {} for i = 1, 1000 do local holder = setmetatable({}, { __gc = function(t) graves[#graves + "
       "1] = t.w "
       "end }) holder.w = widget(i) end collectgarbage() collectgarbage() "
       "for _, w in ipairs(graves) do pcall(w.size, w) tostring(w) end return #graves",
       "1000"},
      {"setmetatable({}, { __gc = function() error 'in gc' end }) collectgarbage() return 'quiet'", "quiet"},
      {"setmetatable({}, { __gc = function() go_wrong 'error' end }) collectgarbage() return 'quiet'",
       "quiet"},
      {"setmetatable({}, { __gc = true }) collectgarbage() return 'quiet'", "quiet"},
      {"setmetatable({}, { __gc = function() collectgarbage() end }) collectgarbage() return 'quiet'",
       "quiet"},
      {"local x <close> = setmetatable({}, { __close = function() error 'closing' end })", "closing"},
      {"local x <close> = widget(1)", "got a non-closable value"},
      {"for i = 1, 300 do local t = setmetatable({}, { __mode = 'k' }) t[widget(i)] = widget(i) end "
       "collectgarbage() return 'quiet'",
       "quiet"},
  });
  // Resurrected after its own finalizer ran: the box is empty, and says so.
  Session session;
  const std::string outcome = session(
      "local keep = setmetatable({}, { __gc = function(t) zombie = t.w end }) keep.w = widget(1) keep = nil "
      "collectgarbage() collectgarbage() collectgarbage() return zombie:size()");
  CHECK((outcome == "1.0" || outcome.find("already finalized") != std::string::npos));
}

TEST_CASE("malice: strange error values") {
  attack({
      {"error()", "user.lua:1: error() was called with nil instead of a message"},
      {"error(nil)", "called with nil"},
      {"error({})", "called with a table"},
      {"error(print)", "called with a function"},
      {"error(true)", "called with a boolean"},
      {"error(widget(1))", "<widget>"},
      {"error(coroutine.create(print))", "called with a coroutine"},
      {"error(42)", "42"},
      {"error('', 0)", ""},
      {"error(('x'):rep(1e6))", "xxx"},
      {"error('a\\0b')", "a"},
      {"return select('#', pcall(error))", "2"},
      {"return call_back(function() error() end)", "called with nil"},
      {"return call_back(function() error({ code = 3 }) end)", "called with a table"},
      {"return tostring(setmetatable({}, { __tostring = function() return {} end }))",
       "must return a string"},
      {"print(setmetatable({}, { __tostring = function() error 'no text' end }))", "no text"},
      {"coroutine.wrap(function() error {} end)()", "called with a table"},
      {"coroutine.wrap(function() widget 'x' end)()", "user.lua:1: widget: bad argument #1"},
      {"local co = coroutine.create(print) coroutine.resume(co) return coroutine.resume(co)", "false"},
      {"return coroutine.resume(coroutine.running())", "false"},
      {"coroutine.yield(1)", "outside a coroutine"},
      {"return coroutine.close(coroutine.running())", "cannot close a running coroutine"},
      {"call_back(coroutine.yield)", "coroutine.yield works in a function that coroutine.wrap"},
      {"coroutine.wrap(function() call_back(coroutine.yield) end)()", "gives its result by return"},
      {"coroutine.yield(1)", "coroutine.wrap or coroutine.create runs"},
      {"return coroutine.wrap(function() return pcall(coroutine.yield, 1) end)()", "1"},
      {"local f = coroutine.wrap(function() local x <close> = setmetatable({}, { __close = function() error "
       "'c' end }) "
       "error 'd' end) f()",
       "c"},
  });
}

TEST_CASE("malice: what the stdlib uses may be destroyed in _G") {
  attack({
      {"print, type, pairs, ipairs, tostring, table.concat = nil expect(1):equals(1) return help ~= nil",
       "true"},
      {"string.format, math.max, table.sort, rawget, pcall, setmetatable = nil expect({1}):near({1}, 1) "
       "return 1",
       "1"},
      {"string.format, string.find = nil expect(1):near(3, 1e-3)", "expected 3 within 0.003, got 1"},
      {"function string.twice(s) return s .. s end return ('ab'):twice()", "abab"},
      {"expect(1):near(2, 'x')", "tol must be a number"},
      {"expect(1):near(2, 0/0)", "tol must be a number"},
      {"expect(0/0):near(1, 1e9)", "expected 1"},
      {"expect(1/0):near(1/0, 0) return 'fine'", "fine"},
      {"expect(1):near(1, 0) return 'fine'", "fine"},
      {"expect(help):near(1)", "not a function"},
      {"expect(3):fails 'x'", "needs a function"},
      {"expect(help):fails(3)", "must be a string"},
      {"expect(1).value2()", "no check 'value2'"},
      {"test(1, 2)", "must be a string"},
      {"test('a', 2)", "must be a function"},
      {"test('a')", "must be a function"},
  });
}

TEST_CASE("malice: Ctrl-C is not caught by the script") {
  Session session;
  for (const std::string script : {
           "while true do end",
           "while true do pcall(function() while true do end end) end",
           "repeat local ok = xpcall(function() while true do end end, function() return 1 end) until false",
           "repeat xpcall(function() while true do end end, function(e) while true do end end) until false",
           "local co = coroutine.create(function() while true do end end) coroutine.resume(co) while true do "
           "end",
           "coroutine.wrap(function() pcall(function() while true do end end) while true do end end)()",
           "while true do local co = coroutine.wrap(function() coroutine.yield() end) co() co() end",
           "while true do call_back(function() pcall(call_back, function() for i = 1, 1e3 do end end) end) "
           "end",
           "pcall(poll_forever) while true do end",
           "call_back(function() poll_forever() end)",
           "table.sort({ 3, 1, 2 }, function() while true do end end)",
           "return ('x'):gsub('x', function() while true do end end)",
           "local t = setmetatable({}, { __index = function() while true do end end }) return t.x",
           "local t = {} while true do t[#t + 1] = widget(1) if #t > 1e4 then t = {} end end",
           "expect(function() while true do end end):fails 'x'",
           "test('x', function() while true do end end)",
           "local x <close> = setmetatable({}, { __close = function() end }) while true do end",
           "goto again ::again:: goto again",
       }) {
    CAPTURE(script);
    const std::clock_t before = std::clock();
    CHECK(interrupted_run(session, script) == "interrupted");
    CHECK(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC < 1.0);
    CHECK(session("return 1 + 1") == "2");
  }
}

TEST_CASE("memory: a loop of temporaries runs in bounded memory") {
  Session session;
  lua::set_memory_cap(session.L, size_t{64} << 20);
  // All of them together would take 134 MB.
  CHECK(session("for i = 1, 6e5 do local w = widget(i):scaled(2) end return 'done'") == "done");
  CHECK(session("local t = {} while true do t[#t + 1] = ('x'):rep(1 << 20) .. #t end")
            .find("user.lua:1: not enough "
                  "memory (a script may") == 0);
  CHECK(session("return 1 + 1") == "2");
}

}  // namespace pendula::malice_test
