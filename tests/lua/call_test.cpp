// Typed arguments, objects, libraries, and how each kind of exception reads for the user.
#include <doctest/doctest.h>

#include "widgets.hpp"

namespace pendula::call_test {

using lua::Session;

namespace {

struct Case {
  const char* script;
  const char* result;
};

void check_all(const std::vector<Case>& cases) {
  Session session;
  for (const Case& c : cases) {
    const std::string script = c.script, expected = c.result;
    CAPTURE(script);
    CHECK(session(script) == expected);
  }
}

}  // namespace

TEST_CASE("objects: methods, fields, operators, integer keys, calls") {
  check_all({{"return widget(3):size()", "3.0"},
             {"return widget(3).half", "1.5"},
             {"return widget(3):scaled(2):size()", "6.0"},
             {"return (widget(3) + widget(4)):size()", "7.0"},
             {"return widget(3)(5)", "15.0"},
             {"return widget(3)[2]", "6.0"},
             {"return tostring(widget(3))", "<widget>"},
             {"return 'a ' .. widget(3) .. '!'", "a <widget>!"},
             {"return getmetatable(widget(3))", "widget"},
             {"return answer", "42"},
             {"return gears.up(2)", "3.0"},
             {"return gears(2)", "called with a number"},
             {"return tostring(gears)", "gears"},
             {"return pendula.widget == widget", "true"},
             {"widget = 5; return pendula.widget(2):size()", "2.0"}});
}

TEST_CASE("arguments: the message names position, argument, expectation and usage") {
  check_all({
      {"return arguments(3.0, true, 'w', {}, print)", "3 1 w"},
      {"arguments(3.5)", "user.lua:1: arguments: bad argument #1 'n': expected an integer, got 3.5"},
      {"arguments('3')",
       "user.lua:1: arguments: bad argument #1 'n': expected an integer, got a string (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"arguments()",
       "user.lua:1: arguments: bad argument #1 'n': expected an integer, got nothing (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"\narguments(1, nil)",
       "user.lua:2: arguments: bad argument #2 'flag': expected true or false, got nil (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"arguments(1, true, {})",
       "user.lua:1: arguments: bad argument #3 'word': expected a string, got a table (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"arguments(1, true, 'w', 'x')",
       "user.lua:1: arguments: bad argument #4 'list': expected a table, got a string (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"return arguments(1, true, 'w', {}, widget(1))", "1 1 w"},
      {"return arguments(1, true, 'w', {}, {})",
       "user.lua:1: arguments: bad argument #5 'f': expected a function, got a table (usage: arguments(n, "
       "flag, "
       "word, list, f))"},
      {"widget(1):scaled('a')",
       "user.lua:1: scaled: bad argument #1 'factor': expected a number, got a string (usage: "
       "w:scaled(factor) -> "
       "widget)"},
      {"widget(1).scaled(2)",
       "user.lua:1: scaled: expected a widget before the colon, got a number (usage: w:scaled(factor) -> "
       "widget)"},
      {"return widget(1) + 2", "user.lua:1: +: the right operand must be a widget, not a number"},
      {"return 2 + widget(1)", "user.lua:1: +: the left operand must be a widget, not a number"},
      {"return widget(1)(nil)",
       "user.lua:1: widget: bad argument #1 'x': expected a number, got nil (usage: w(x))"},
      {"return io.stdout + widget(1)", "user.lua:1: +: the left operand must be a widget, not a file"},
  });
}

TEST_CASE("options: unknown names, wrong types, strange keys") {
  check_all({
      {"return configure()", "3 0.5 acc 0"},
      {"return configure{ steps = 4.0, dt = 1, form = 'ggl', exact = true }", "4 1 ggl 1"},
      {"configure{ stps = 1 }",
       "user.lua:1: configure: unknown option 'stps'. Did you mean 'steps'? (options: steps, dt, form, "
       "exact)"},
      {"configure{ 1 }",
       "user.lua:1: configure: options are written { name = value }, but this table has the key [1]; known "
       "options: "
       "steps, dt, form, exact"},
      {"configure{ dt = 'x' }", "user.lua:1: configure: option 'dt': expected a number, got a string"},
      {"configure{ steps = 1.5 }", "user.lua:1: configure: option 'steps': expected an integer, got 1.5"},
      {"configure{ exact = 1 }",
       "user.lua:1: configure: option 'exact': expected true or false, got a number (whether exact)"},
      {"configure{ form = 1 }", "user.lua:1: configure: option 'form': expected a string, got a number"},
      {"configure(3)",
       "user.lua:1: configure: bad argument #1 'options': expected a table of options, got a number (usage: "
       "configure{…})"},
  });
}

TEST_CASE("exceptions: each kind reads as it should") {
  check_all({
      {"go_wrong 'error'", "user.lua:1: go_wrong: the matrix is singular"},
      {"go_wrong 'failure'", "user.lua:1: go_wrong: Newton did not converge"},
      {"go_wrong 'memory'", "user.lua:1: go_wrong: not enough memory for a result of this size"},
      {"go_wrong 'length'", "user.lua:1: go_wrong: not enough memory for a result of this size"},
      {"go_wrong 'interrupt'", "interrupted"},
      {"pcall(go_wrong, 'interrupt')", "interrupted"},
      {"go_wrong 'assert'",
       "user.lua:1: internal error in go_wrong: this cannot be [widgets.cpp:69] (please report)"},
      {"go_wrong 'other'", "user.lua:1: internal error in go_wrong: unforeseen (please report)"},
      {"return select(2, pcall(go_wrong, 'error'))", "user.lua:1: go_wrong: the matrix is singular"},
  });
}

TEST_CASE("callbacks: errors keep their own position, objects their identity") {
  check_all({
      {"return call_back(function() return 5 end)", "5"},
      {"call_back(function()\n error 'inside'\nend)", "user.lua:2: inside\n  called from user.lua:1"},
      {"call_back(function()\n local t = nil\n return t.x\nend)",
       "user.lua:3: attempt to index a nil value (local 't')\n  called from user.lua:1"},
      {"local e = {} local _, got = pcall(call_back, function() error(e) end) return got == e", "true"},
      {"return call_back(function() return call_back(function() go_wrong 'error' end) end)",
       "user.lua:1: go_wrong: the matrix is singular"},
      {"pcall(call_back, function() go_wrong 'interrupt' end)", "interrupted"},
      {"call_back(3)",
       "user.lua:1: call_back: bad argument #1 'f': expected a function, got a number (usage: call_back(f))"},
  });
}

TEST_CASE("globals and libraries are strict") {
  check_all({
      {"return widgit(1)", "user.lua:1: undefined variable 'widgit'. Did you mean 'widget'?"},
      {"return gears.upp", "user.lua:1: 'gears' has no entry 'upp'. Did you mean 'up'?"},
      {"return pendula.gear", "user.lua:1: 'pendula' has no entry 'gear'. Did you mean 'gears'?"},
      {"return widget(1).hlaf",
       "user.lua:1: a widget has no field or method 'hlaf'. Did you mean 'half'? (list: help \"widget\")"},
      {"return widget(1)[true]",
       "user.lua:1: a widget cannot be indexed with a boolean (list: help \"widget\")"},
      {"widget(1).half = 2",
       "user.lua:1: cannot set 'half': a widget is immutable; operations return a new value instead"},
      {"new_name = 1; return new_name", "1"},
      {"local x = rawget(_G, 'absent'); return x == nil", "true"},
  });
}

}  // namespace pendula::call_test
