#include "lua/session/streams.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

#include "base/interrupt.hpp"
#include "lua/screen/pager.hpp"
#include "lua/session/long_calls.hpp"

namespace pendula::lua {

namespace {

int descriptor_of(void* cookie) { return static_cast<int>(reinterpret_cast<std::intptr_t>(cookie)); }

/// Reads one block. Lua requests a whole line, count or file in one call, which can be
/// interrupted between blocks.
ssize_t read_block(void* cookie, char* bytes, std::size_t size) {
  if (interrupt_requested.load()) {
    errno = EINTR;
    return -1;
  }
  return read(descriptor_of(cookie), bytes, std::min(size, std::size_t{1} << 20));
}

int move_to(void* cookie, off64_t* position, int whence) {
  *position = lseek64(descriptor_of(cookie), *position, whence);
  return *position < 0 ? -1 : 0;
}

int close_descriptor(void* cookie) { return close(descriptor_of(cookie)); }

/// Makes a file at stack index i that was just opened for reading use read_block.
void make_stoppable(lua_State* L, int i) {
  auto* stream = static_cast<luaL_Stream*>(luaL_testudata(L, i, LUA_FILEHANDLE));
  if (!stream || !stream->closef || stream->f == stdin) return;
  const int given = fileno(stream->f);
  if (given < 0 || (fcntl(given, F_GETFL) & O_ACCMODE) != O_RDONLY) return;
  const int own = fcntl(given, F_DUPFD_CLOEXEC, 3);
  if (own < 0) return;
  std::FILE* const file = fopencookie(reinterpret_cast<void*>(static_cast<std::intptr_t>(own)), "r",
                                      {read_block, nullptr, move_to, close_descriptor});
  if (!file) {
    close(own);
    return;
  }
  std::setvbuf(file, nullptr, _IOFBF, 1 << 16);
  std::fclose(stream->f);
  stream->f = file;
}

/// io.open(name, mode). Upvalue: the original.
int open_file(lua_State* L) {
  const int results = call_original(L);
  if (results == 1) make_stoppable(L, -1);
  return results;
}

/// io.lines(name, …): the file is the fourth result. Upvalue: the original.
int lines_of_file(lua_State* L) {
  const int results = call_original(L);
  if (results == 4) make_stoppable(L, -1);
  return results;
}

/// io.input(name or file): the result is the file. Upvalue: the original.
int input_file(lua_State* L) {
  const bool opened = lua_type(L, 1) == LUA_TSTRING;
  const int results = call_original(L);
  if (opened && results == 1) make_stoppable(L, -1);
  return results;
}

/// Calls the original with the values before `first` and the bytes; returns true, or false with its results
/// on the stack.
bool write_piece(lua_State* L, int first, std::string_view bytes) {
  const int top = lua_gettop(L);
  lua_pushvalue(L, lua_upvalueindex(1));
  for (int i = 1; i < first; ++i) lua_pushvalue(L, i);
  lua_pushlstring(L, bytes.data(), bytes.size());
  lua_call(L, first, LUA_MULTRET);
  if (lua_isnil(L, top + 1)) return false;
  lua_settop(L, top);
  return true;
}

/// io.write(…) and file:write(…): write long texts in pieces, so that Ctrl-C ends a write that waits for its
/// reader. `first` is the index of the first text. Upvalue: the original.
template <int first>
int write_texts(lua_State* L) {
  const int count = lua_gettop(L);
  bool all_short = true;
  for (int i = first; i <= count; ++i)
    all_short = all_short && (lua_type(L, i) != LUA_TSTRING || lua_rawlen(L, i) <= whole_piece);
  if (all_short) return call_original(L);
  for (int i = first; i <= count; ++i) {
    std::size_t size = 0;
    const char* bytes = luaL_checklstring(L, i, &size);
    for (std::size_t at = 0; at < size && !interrupt_requested.load(); at += whole_piece)
      if (!write_piece(L, first, {bytes + at, std::min(whole_piece, size - at)}))
        return lua_gettop(L) - count;
  }
  lua_settop(L, first - 1);
  return call_original(L);  // with nothing to write, returns the file
}

}  // namespace

void open_streams(lua_State* L) {
  constexpr luaL_Reg replaced[] = {
      {"open", open_file}, {"lines", lines_of_file}, {"input", input_file}, {"write", write_texts<1>}};
  lua_getglobal(L, "io");
  for (const luaL_Reg& row : replaced) {
    lua_getfield(L, -1, row.name);
    lua_pushcclosure(L, row.func, 1);
    lua_setfield(L, -2, row.name);
  }
  luaL_getmetatable(L, LUA_FILEHANDLE);
  lua_getfield(L, -1, "__index");
  lua_getfield(L, -1, "write");
  lua_pushcclosure(L, write_texts<2>, 1);
  lua_setfield(L, -2, "write");
  lua_pop(L, 3);
}

}  // namespace pendula::lua
