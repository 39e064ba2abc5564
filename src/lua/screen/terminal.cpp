#include "lua/screen/terminal.hpp"

#include <cstdio>
#include <cstring>

#include <unistd.h>
#include <lua.hpp>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::lua {
namespace {

bool is_prompt(const lua_Debug& frame) {
  return std::strcmp(frame.what, "main") == 0 && std::strcmp(frame.source, "=stdin") == 0;
}
bool is_library(const lua_Debug& frame) {
  return std::strcmp(frame.what, "C") == 0 || std::strncmp(frame.source, "=stdlib/", 8) == 0;
}

}  // namespace

bool typed_at_prompt(lua_State* L) {
  lua_Debug frame;
  if (!isatty(STDIN_FILENO) || lua_getstack(L, 1, &frame) == 0) return false;
  lua_getinfo(L, "S", &frame);
  return is_prompt(frame);
}

int level_of_prompt(lua_State* L) {
  lua_Debug frame;
  if (!isatty(STDIN_FILENO)) return 0;
  for (int level = 1; lua_getstack(L, level, &frame) != 0; ++level) {
    lua_getinfo(L, "S", &frame);
    if (is_prompt(frame)) return level;
    if (!is_library(frame)) return 0;
  }
  return 0;
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

CountProgress::CountProgress(std::string title, std::string what, int count)
    : title_(std::move(title)),
      what_(std::move(what)),
      count_(count),
      line_(std::chrono::seconds(1), std::chrono::milliseconds(0)),
      begin_(std::chrono::steady_clock::now()) {}

void CountProgress::operator()(int done) {
  if (!first_) first_ = done;
  if (done == last_ || !line_.due()) return;
  last_ = done;
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin_;
  const double rate = (done - *first_) / passed.count();
  std::string out = text(title_, ": ", done, " of ", count_, " ", what_);
  if (rate > 0) out += text(", ", rounded(rate, 2), "/s, ", rounded((count_ - done) / rate, 2), " s left");
  line_.show(out);
}

}  // namespace pendula::lua
