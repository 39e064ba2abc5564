#include "lua/session/streams.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

#include "base/interrupt.hpp"
#include "lua/session/long_calls.hpp"

namespace pendula::lua {

namespace {

int descriptor_of(void* cookie) { return static_cast<int>(reinterpret_cast<std::intptr_t>(cookie)); }

/// Lua asks for a whole line, count or file in one call; each block of it comes from here.
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

/// A file at stack index i that was just opened only to be read continues by read_block.
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

}  // namespace

void open_streams(lua_State* L) {
  constexpr luaL_Reg replaced[] = {{"open", open_file}, {"lines", lines_of_file}, {"input", input_file}};
  lua_getglobal(L, "io");
  for (const luaL_Reg& row : replaced) {
    lua_getfield(L, -1, row.name);
    lua_pushcclosure(L, row.func, 1);
    lua_setfield(L, -2, row.name);
  }
  lua_pop(L, 1);
}

}  // namespace pendula::lua
