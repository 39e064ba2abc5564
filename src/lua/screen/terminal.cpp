#include "lua/screen/terminal.hpp"

#include <cstdio>
#include <cstring>

#include <unistd.h>
#include <lua.hpp>

namespace pendula::lua {

bool typed_at_prompt(lua_State* L) {
  lua_Debug frame;
  if (!isatty(STDIN_FILENO) || lua_getstack(L, 1, &frame) == 0) return false;
  lua_getinfo(L, "S", &frame);
  return std::strcmp(frame.what, "main") == 0 && std::strcmp(frame.source, "=stdin") == 0;
}

ProgressLine::ProgressLine(Milliseconds first, Milliseconds between)
    : between_(between),
      terminal_(isatty(STDERR_FILENO) != 0),
      next_(std::chrono::steady_clock::now() + first) {}

ProgressLine::~ProgressLine() {
  if (shown_) std::fprintf(stderr, "\r\033[K");
}

void ProgressLine::show(const std::string& line) {
  next_ = std::chrono::steady_clock::now() + between_;
  shown_ = true;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

}  // namespace pendula::lua
