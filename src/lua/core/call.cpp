#include "lua/core/call.hpp"

#include <cstring>
#include <new>

#include "lua/core/documentation.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

std::string with_article(const std::string& noun) {
  if (noun == "lti") return "a linear system";
  const bool spelled = noun == "fn";  // takes "an", since it is spelled "ef-en"
  const bool vowel = spelled || (!noun.empty() && std::strchr("aeioAEIO", noun[0]) != nullptr);
  return (vowel ? "an " : "a ") + noun;
}

namespace {

/// How the name of a row determines the numbering of its arguments.
struct RowKind {
  bool method = false;  ///< argument 1 precedes a colon or an opening parenthesis
  bool binary = false;  ///< an operator, with arguments 1 and 2 on its left and right
};

RowKind kind_of(const Row& row) {
  const char* method = std::strpbrk(row.name, ":#");
  if (!method) return {};
  ++method;
  if (std::strncmp(method, "__", 2) != 0 || std::strcmp(method, "__call") == 0) return {true, false};
  for (const char* unary : {"__unm", "__len", "__bnot", "__tostring", "__index", "__close"}) {
    if (std::strcmp(method, unary) == 0) return {true, false};
  }
  return {true, true};
}

bool callable(lua_State* L, int i) {
  if (lua_isfunction(L, i)) return true;
  if (luaL_getmetafield(L, i, "__call") == LUA_TNIL) return false;
  lua_pop(L, 1);
  return true;
}

}  // namespace

Call::Call(lua_State* state, const Row& r) : L(state), row(r), count_(lua_gettop(state)) {}

bool Call::has(int i) const { return i <= count_ && !lua_isnoneornil(L, i); }

std::string Call::usage() const {
  const std::string signature = prose(row.signature);
  return signature.empty() ? "" : text(" (usage: ", signature, ")");
}

void Call::wrong(int i, const char* name, const std::string& expected) const {
  const RowKind kind = kind_of(row);
  if (i == 2 && std::string_view(row.name).ends_with(":__index") && lua_type(L, 2) == LUA_TSTRING)
    unknown_member(L, object_type(L, 1).c_str());
  const std::string got = i <= count_ ? describe(L, i) : "nothing";
  if (kind.binary) {
    throw Error(text("the ", i == 1 ? "left" : "right", " operand must be ", expected, ", not ", got));
  }
  if (kind.method && i == 1) {
    throw Error(text("expected ", expected, " before the colon, got ", got, usage()));
  }
  throw Error(text("bad argument #", kind.method ? i - 1 : i, " '", name, "': expected ", expected, ", got ",
                   got, usage()));
}

double Call::number(int i, const char* name) const {
  if (i <= count_ && lua_type(L, i) == LUA_TNUMBER) return lua_tonumber(L, i);
  if (const auto value = constant_at(L, i)) return *value;  // 2*pi
  wrong(i, name, "a number");
}

double Call::number(int i, const char* name, double fallback) const {
  return has(i) ? number(i, name) : fallback;
}

long Call::integer(int i, const char* name) const {
  int whole = 0;
  const bool is_number = i <= count_ && lua_type(L, i) == LUA_TNUMBER;
  const lua_Integer value = is_number ? lua_tointegerx(L, i, &whole) : 0;
  if (is_number && !whole) {
    throw Error(text("bad argument #", kind_of(row).method ? i - 1 : i, " '", name,
                     "': expected an integer, got ", luaL_tolstring(L, i, nullptr)));
  }
  if (!whole) wrong(i, name, "an integer");
  return static_cast<long>(value);
}

long Call::integer(int i, const char* name, long fallback) const {
  return has(i) ? integer(i, name) : fallback;
}

bool Call::boolean(int i, const char* name) const {
  if (i > count_ || !lua_isboolean(L, i)) wrong(i, name, "true or false");
  return lua_toboolean(L, i) != 0;
}

std::string Call::string(int i, const char* name) const {
  if (i > count_ || lua_type(L, i) != LUA_TSTRING) wrong(i, name, "a string");
  size_t size = 0;
  const char* bytes = lua_tolstring(L, i, &size);
  return {bytes, size};
}

std::string Call::string(int i, const char* name, const std::string& fallback) const {
  return has(i) ? string(i, name) : fallback;
}

void Call::function(int i, const char* name) const {
  if (i > count_ || !callable(L, i)) wrong(i, name, "a function");
}

void Call::table(int i, const char* name) const {
  if (i > count_ || !lua_istable(L, i)) wrong(i, name, "a table");
}

int Call::push(double value) const {
  lua_pushnumber(L, value);
  return 1;
}

int Call::push(long value) const {
  lua_pushinteger(L, value);
  return 1;
}

int Call::push_nil() const {
  lua_pushnil(L);
  return 1;
}

int Call::push(bool value) const {
  lua_pushboolean(L, value ? 1 : 0);
  return 1;
}

int Call::push(const std::string& value) const {
  lua_pushlstring(L, value.data(), value.size());
  return 1;
}

std::shared_ptr<const void>* Call::test(int i, const char* type) const {
  return i <= count_ ? object_at(L, i, type) : nullptr;
}

std::shared_ptr<const void> Call::required(int i, const char* type, const char* name) const {
  const std::shared_ptr<const void>* object = test(i, type);
  if (!object) wrong(i, name, with_article(type));
  if (!*object) {
    throw Error(text("'", name, "' is ", with_article(type),
                     " that was already finalized; a value cannot be used after its __gc has run"));
  }
  return *object;
}

std::string describe(lua_State* L, int index) {
  switch (lua_type(L, index)) {
    case LUA_TNONE:
      return "nothing";
    case LUA_TNIL:
      return "nil";
    case LUA_TLIGHTUSERDATA:
      return "a pointer";
    case LUA_TTHREAD:
      return "a coroutine";
    case LUA_TUSERDATA: {
      if (luaL_getmetafield(L, index, "__name") == LUA_TNIL) return "a userdata";
      const std::string name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "userdata";
      lua_pop(L, 1);
      return name == "FILE*" ? "a file" : with_article(name);
    }
    default:
      return with_article(luaL_typename(L, index));
  }
}

std::string key_in_words(lua_State* L, int index) {
  const bool plain = luaL_getmetafield(L, index, "__tostring") == LUA_TNIL;
  if (!plain) lua_pop(L, 1);
  const int type = lua_type(L, index);
  if (plain && type != LUA_TSTRING && type != LUA_TNUMBER && type != LUA_TBOOLEAN) return describe(L, index);
  std::string text = luaL_tolstring(L, index, nullptr);
  lua_pop(L, 1);
  return text;
}

void protected_call(lua_State* L, int arguments, int results) {
  const int status = call_with_handler(L, guarded<keep_error>, arguments, results);
  if (status == LUA_OK) return;
  if (is_interrupt_marker(L, -1)) {
    lua_pop(L, 1);
    throw Interrupted();
  }
  if (status == LUA_ERRMEM) {
    lua_pop(L, 1);
    throw std::bad_alloc();
  }
  const std::string message = error_text(L, -1);
  lua_pop(L, 1);
  throw LuaError(message);
}

}  // namespace pendula::lua
