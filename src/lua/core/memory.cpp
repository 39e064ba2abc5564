#include "lua/core/memory.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <utility>

#include "base/error.hpp"
#include "base/remembered.hpp"
#include "expr/graph/graph.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

constexpr size_t MiB = size_t{1} << 20;
constexpr size_t reserve_size = MiB / 2;

struct Budget {
  size_t used = 0;
  size_t cap = 0;
  char source[LUA_IDSIZE] = "";  ///< position; no std::string, since memory is exhausted
  int line = 0;
};

size_t physical_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page = sysconf(_SC_PAGESIZE);
  return pages > 0 && page > 0 ? static_cast<size_t>(pages) * static_cast<size_t>(page) : 4096 * MiB;
}

/// Records the position of an out-of-memory error, which has none in Lua (its message is preallocated).
/// "Sl" allocates nothing.
void note_position(Budget& budget) {
  budget.line = 0;
  lua_State* L = running_state();
  if (!L) return;
  lua_Debug frame;
  for (int level = 0; lua_getstack(L, level, &frame) != 0; ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline <= 0 || std::strncmp(frame.source, "=stdlib/", 8) == 0) continue;
    std::copy(std::begin(frame.short_src), std::end(frame.short_src), budget.source);
    budget.line = frame.currentline;
    return;
  }
}

/// Implements lua_Alloc. The last block freed is the state itself, and the budget is freed with it.
void* allocate(void* data, void* block, size_t old_size, size_t new_size) {
  auto* budget = static_cast<Budget*>(data);
  if (!block) old_size = 0;  // Lua passes a type tag there
  if (new_size == 0) {
    std::free(block);
    budget->used -= old_size;
    if (block && budget->used == 0) delete budget;
    return nullptr;
  }
  const bool fits =
      new_size <= old_size || new_size - old_size <= budget->cap - std::min(budget->cap, budget->used);
  void* moved = fits ? std::realloc(block, new_size) : nullptr;
  if (!moved) {
    note_position(*budget);
    return nullptr;
  }
  budget->used += new_size - old_size;
  return moved;
}

Budget& budget_of(lua_State* L) {
  void* data = nullptr;
  lua_getallocf(L, &data);
  return *static_cast<Budget*>(data);
}

/// Resident bytes of this process; 0 if /proc is not mounted.
size_t resident() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char line[128] = "";
  const ssize_t size = read(file, line, sizeof line - 1);
  close(file);
  if (size <= 0) return 0;
  char* second = nullptr;
  std::strtoull(line, &second, 10);
  return static_cast<size_t>(std::strtoull(second, nullptr, 10)) * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

lua_State* new_capped_state() {
  auto* budget = new Budget;
  budget->cap = std::min(physical_memory() / 2, 8192 * MiB);
  lua_State* L = lua_newstate(allocate, budget);
  if (!L && budget->used == 0) delete budget;
  return L;
}

void set_memory_cap(lua_State* L, size_t bytes) { budget_of(L).cap = bytes; }

void limit_process_memory() {
#ifndef __SANITIZE_ADDRESS__
  rlimit limit = {};
  const rlim_t wanted = physical_memory() / 4 * 3;
  if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur <= wanted) return;
  limit.rlim_cur = wanted;
  setrlimit(RLIMIT_DATA, &limit);
#endif
}

std::string memory_message(lua_State* L) {
  const Budget& budget = budget_of(L);
  const std::string where = budget.line > 0 ? text(budget.source, ":", budget.line, ": ") : "";
  return text(where, "not enough memory (a script may use ", budget.cap / MiB, " MiB)");
}

Reserve::Reserve(lua_State* L) : cap_(&budget_of(L).cap) { *cap_ += reserve_size; }
Reserve::~Reserve() { *cap_ -= reserve_size; }

void collect(lua_State* L) {
  lua_gc(L, LUA_GCCOLLECT);
#if defined(__GLIBC__)
  malloc_trim(0);  // otherwise freed memory stays resident, and the limit of collect_if_grown() keeps growing
#endif
}

void collect_if_grown(lua_State* L) {
  constexpr size_t look_every = 64;
  static thread_local size_t pushed = 0;
  static thread_local size_t limit = 256 * MiB;
  if (++pushed % look_every != 0) return;
  if (resident() < limit) return;
  collect(L);
  limit = std::max(256 * MiB, 2 * resident());
}

/// A window ends after this number of new expressions, at least, and after half of those that were kept
/// when it began, and after this multiple of the number made by the largest call. Half: a model that is
/// alive when a window ends, as in sys:reduce():integrate{ … }, keeps all of that window until the next one
/// ends; where the next one were as long as what is kept, windows would become longer without bound. Cached
/// results are discarded with a window. That pays if many calls have made few expressions each; a single
/// call that made most of them, for a large model, would have to compute them again.
struct WindowLength {
  std::uint32_t fewest = 1 << 15;  // 10 MB
  std::uint32_t calls = 8;
};

/// The environment variable PENDULA_WINDOW makes windows short, for tests.
static WindowLength window_length() {
  const char* given = std::getenv("PENDULA_WINDOW");
  return given ? WindowLength{static_cast<std::uint32_t>(std::max(1, std::atoi(given))), 1} : WindowLength{};
}

void begin_window_if_grown(lua_State* L) {
  static const WindowLength length = window_length();
  // the expressions of the library are in a window of their own
  static const std::uint32_t of_the_library = begin_window();
  static std::uint32_t begin = of_the_library, last = begin, most_of_one_call = 0, kept = 0;
  const std::uint32_t size = graph_size(), made = size - begin;
  most_of_one_call = std::max(most_of_one_call, size - std::exchange(last, size));
  if (made >= std::max(length.fewest, kept / 2) && made / length.calls >= most_of_one_call) {
    lua_gc(L, LUA_GCCOLLECT);
    give_back(windows_in_use(), touch_known_expressions);
    begin = size;
    kept = expressions_in_use();
    most_of_one_call = 0;
  }
  Origins::begin(expression_window());
}

}  // namespace pendula::lua
