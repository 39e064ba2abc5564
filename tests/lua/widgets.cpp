#include "widgets.hpp"

#include <new>
#include <stdexcept>

#include "base/interrupt.hpp"

namespace pendula::lua {

namespace {

int widget(Call& call) {
  auto made = std::make_shared<Widget>();
  made->size = call.number(1, "size", 1.0);
  return call.push(std::shared_ptr<const Widget>(made));
}

int size(Call& call) { return call.push(call.object<Widget>(1, "widget").size); }
int half(Call& call) { return call.push(call.object<Widget>(1, "widget").size / 2); }

int scaled(Call& call) {
  auto made = std::make_shared<Widget>(call.object<Widget>(1, "widget"));
  made->size *= call.number(2, "factor");
  return call.push(std::shared_ptr<const Widget>(made));
}

int add(Call& call) {
  auto made = std::make_shared<Widget>(call.object<Widget>(1, "a"));
  made->size += call.object<Widget>(2, "b").size;
  return call.push(std::shared_ptr<const Widget>(made));
}

int apply(Call& call) { return call.push(call.object<Widget>(1, "widget").size * call.number(2, "x")); }

int index(Call& call) {
  if (lua_type(call.L, 2) != LUA_TNUMBER) return 0;
  return call.push(static_cast<double>(call.integer(2, "i")) * call.object<Widget>(1, "widget").size);
}

const OptionTable configure_options = {
    {"steps", "integer", "3", ""},
    {"dt", "number", "0.5", ""},
    {"form", "string", "\"acc\"", ""},
    {"exact", "boolean", "false", "whether exact"},
};

int configure(Call& call) {
  const Options options = call.options(1, configure_options);
  return call.push(text(options.integer("steps", 3), " ", options.number("dt", 0.5), " ",
                        options.string("form", "acc"), " ", options.boolean("exact", false)));
}

int arguments(Call& call) {
  const long n = call.integer(1, "n");
  const bool flag = call.boolean(2, "flag");
  const std::string word = call.string(3, "word");
  call.table(4, "list");
  call.function(5, "f");
  return call.push(text(n, " ", flag, " ", word));
}

int go_wrong(Call& call) {
  const std::string how = call.string(1, "how");
  if (how == "error") throw Error("the matrix is singular");
  if (how == "failure") throw Failure("Newton did not converge");
  if (how == "memory") throw std::bad_alloc();
  if (how == "length") throw std::length_error("vector");
  if (how == "interrupt") throw Interrupted();
  PENDULA_ASSERT(how != "assert", "this cannot be");
  throw std::runtime_error("unforeseen");
}

int call_back(Call& call) {
  call.function(1, "f");
  lua_pushvalue(call.L, 1);
  protected_call(call.L, 0, 1);
  return 1;
}

int poll_forever(Call&) {
  while (true) poll_interrupt();
}

int constant(Call& call) { return call.push(42); }
int library_call(Call& call) { return call.push("called with " + describe(call.L, 1)); }
int library_entry(Call& call) { return call.push(call.number(1, "x") + 1); }

}  // namespace

extern const Module widgets = {
    "widgets",
    "Widgets for tests",
    {
        {"widget", widget, "widget([size]) -> widget", "Makes a widget.", "widget(3):size()", "3.0"},
        {"widget:size", size, "w:size() -> number", "The size."},
        {"widget:scaled", scaled, "w:scaled(factor) -> widget", "A larger one."},
        {"widget#half", half, "w.half", "Half the size."},
        {"widget:__add", add, "w1 + w2", "The sum."},
        {"widget:__call", apply, "w(x)", "Size times x."},
        {"widget:__index", index, "w[i]", "The i-th multiple."},
        {"configure", configure, "configure{…}", "Options.", "configure{ steps = 2 }", "2 0.5 acc 0"},
        {"arguments", arguments, "arguments(n, flag, word, list, f)", "Reads.", "x = 1; x + 1", "2"},
        {"go_wrong", go_wrong, "go_wrong(how)", "Goes wrong.", "print(1, 2); nil", "1\t2\nnil"},
        {"call_back", call_back, "call_back(f)", "Calls f.", "call_back(function() return 7 end)", "7"},
        {"poll_forever", poll_forever, "poll_forever()", "Never returns.", "local a = 1", ""},
        {"=answer", constant, "answer", "A value."},
        {"gears", library_call, "gears(x)", "A library that is a function.", "gears(1)",
         "called with a number"},
        {"gears.up", library_entry, "gears.up(x)", "One more.", "gears.up(1)", "2.0"},
    }};

std::string Session::operator()(const std::string& script) {
  lua_settop(L, 0);
  const bool good =
      luaL_loadbufferx(L, script.data(), script.size(), "@user.lua", "t") == LUA_OK && run(L, 0, LUA_MULTRET);
  if (!good && is_interrupt(L, -1)) return "interrupted";
  if (!good) return lua_tostring(L, -1);
  return lua_gettop(L) == 0 ? "ok" : luaL_tolstring(L, 1, nullptr);
}

}  // namespace pendula::lua
