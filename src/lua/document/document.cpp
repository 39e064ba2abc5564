#include "lua/document/document.hpp"

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/text.hpp"
#include "lua/core/embedded.hpp"
#include "lua/core/library.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/document/capture.hpp"
#include "lua/document/tokens.hpp"

namespace pendula::lua {
namespace {

std::string_view bytes_at(lua_State* L, int index) {
  std::size_t size = 0;
  const char* bytes = luaL_checklstring(L, index, &size);
  return {bytes, size};
}

const char* kind_name(TokenKind kind) {
  switch (kind) {
    case TokenKind::name:
      return "name";
    case TokenKind::keyword:
      return "keyword";
    case TokenKind::number:
      return "number";
    case TokenKind::string:
      return "string";
    case TokenKind::symbol:
      return "symbol";
    default:
      return "unfinished";
  }
}

int lua_tokens(lua_State* L) {
  const auto tokens = tokenize(bytes_at(L, 1));
  lua_createtable(L, static_cast<int>(tokens.size()), 0);
  lua_Integer n = 0;
  for (const Token& token : tokens) {
    lua_createtable(L, 0, 3);
    lua_pushstring(L, kind_name(token.kind));
    lua_setfield(L, -2, "kind");
    lua_pushinteger(L, static_cast<lua_Integer>(token.begin + 1));
    lua_setfield(L, -2, "first");
    lua_pushinteger(L, static_cast<lua_Integer>(token.begin + token.text.size()));
    lua_setfield(L, -2, "last");
    lua_rawseti(L, -2, ++n);
  }
  return 1;
}

int embedded_bytes(lua_State* L) {
  const std::string_view name = bytes_at(L, 1);
  for (const EmbeddedFile& file : embedded_stdlib()) {
    if (name != file.name) continue;
    lua_pushlstring(L, reinterpret_cast<const char*>(file.bytes), file.size);
    return 1;
  }
  throw std::logic_error(text("there is no embedded file stdlib/", name));
}

int base64(lua_State* L) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string_view bytes = bytes_at(L, 1);
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i])) : 0u;
  };
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned three = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : letters[three >> (18 - 6 * k) & 63];
  }
  lua_pushlstring(L, out.data(), out.size());
  return 1;
}

int clock(lua_State* L) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  lua_pushnumber(L, std::chrono::duration<double>(now).count());
  return 1;
}

/// The capture of the output is global, because file descriptors belong to the process.
std::unique_ptr<Capture>& capture() {
  static std::unique_ptr<Capture> instance;
  return instance;
}

int capture_output(lua_State* L) {
  capture().reset();
  if (lua_toboolean(L, 1)) capture() = std::make_unique<Capture>();
  return 0;
}

int captured(lua_State* L) {
  const std::string text = capture() ? capture()->take() : "";
  lua_pushlstring(L, text.data(), text.size());
  return 1;
}

}  // namespace

void open_document(lua_State* L) {
  const std::pair<const char*, lua_CFunction> functions[] = {{"lua_tokens", guarded<lua_tokens>},
                                                             {"embedded", guarded<embedded_bytes>},
                                                             {"base64", guarded<base64>},
                                                             {"clock", guarded<clock>},
                                                             {"capture_output", guarded<capture_output>},
                                                             {"captured", guarded<captured>}};
  push_stdlib_environment(L);
  lua_pushliteral(L, PENDULA_VERSION);
  lua_setfield(L, -2, "program_version");
  std::error_code ignored;
  lua_pushstring(L, std::filesystem::read_symlink("/proc/self/exe", ignored).c_str());
  lua_setfield(L, -2, "program_path");
  for (const auto& [name, function] : functions) {
    lua_pushcfunction(L, function);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

}  // namespace pendula::lua
