// libFuzzer on what is read from files and texts. The first byte of an input chooses the reader.
//   ./dev fuzz builds it with clang, address and undefined-behaviour sanitizers, and
//   runs it on build/asan/corpus
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <lua.hpp>

#include "lua/session/state.hpp"

namespace {

/// What each kind of text goes through. An error is an answer; "internal error …
/// (please report)" is a finding.
constexpr const char* readers[] = {
    "local text, file = ... return load(file)",     // saved values, expressions, code()
    "local text, file = ... return tableau(text)",  // a tableau as text
    "local text, file = ... return iddata.read(file, { y = 1, Ts = 1 })",    // CSV
    "local text, file = ... return iddata.read(file, { y = 'y', Ts = 1 })",  // MAT
    "local text = ... return rational(text), tonumber(text), vec{ text }",   // numbers
    "local text = ... local f = load(text) return f ~= nil",                 // the syntax of Lua
};
constexpr const char* endings[] = {".lua", ".txt", ".csv", ".mat", ".txt", ".txt"};

lua_State* state() {
  static lua_State* const L = pendula::lua::new_state();
  return L;
}

std::string folder() {
  static const std::string path = [] {
    char name[] = "/tmp/pendula-fuzz-XXXXXX";
    return std::string(mkdtemp(name));
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t kind = data[0] % std::size(readers);
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string file = folder() + "/input" + endings[kind];
  if (std::FILE* out = std::fopen(file.c_str(), "wb")) {
    std::fwrite(text.data(), 1, text.size(), out);
    std::fclose(out);
  }
  lua_State* const L = state();
  luaL_loadstring(L, readers[kind]);
  lua_pushlstring(L, text.data(), text.size());
  lua_pushlstring(L, file.data(), file.size());
  if (!pendula::lua::run(L, 2, 0)) {
    const char* message = lua_tostring(L, -1);
    const auto asks = [](const std::string& said) { return said.find("please report") != std::string::npos; };
    if (message && asks(message) && !asks(text)) {  // messages quote what they were given
      std::fprintf(stderr, "%s\n", message);
      std::abort();
    }
  }
  lua_settop(L, 0);
  return 0;
}
