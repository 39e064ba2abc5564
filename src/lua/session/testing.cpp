#include "lua/session/testing.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.hpp"
#include "lua/core/library.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/session/state.hpp"

namespace pendula::lua {

namespace {

namespace fs = std::filesystem;

struct TestCounts {
  long passed = 0;
  long failed = 0;
};

struct CloseState {
  void operator()(lua_State* L) const { lua_close(L); }
};

/// Throws Error if there is no such path.
void append_files(const std::string& path, std::vector<std::string>& files) {
  std::error_code problem;
  if (fs::is_regular_file(path, problem)) {
    files.push_back(path);
    return;
  }
  if (!fs::is_directory(path, problem)) throw Error(text("pendula test: no file or directory '", path, "'"));
  std::vector<std::string> found;
  const auto skip = fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator i(path, skip, problem), end; i != end; i.increment(problem)) {
    const fs::path& file = i->path();
    fs::path expected = file;
    expected.replace_extension(".out");
    std::error_code ignored;
    if (file.extension() == ".lua" && i->is_regular_file(ignored) && !fs::exists(expected, ignored)) {
      found.push_back(file.string());
    }
  }
  std::sort(found.begin(), found.end());
  files.insert(files.end(), found.begin(), found.end());
}

/// Calls a function of the stdlib's environment. Throws LuaError or Interrupted.
void call_stdlib(lua_State* L, const char* function, int arguments, int results) {
  push_stdlib_environment(L);
  lua_getfield(L, -1, function);
  lua_remove(L, -2);
  lua_insert(L, -(arguments + 1));
  protected_call(L, arguments, results);
}

/// Leaves nothing on the stack, or the error value.
bool load_and_run(lua_State* L, const std::string& file) {
  lua_createtable(L, 0, 1);
  lua_pushstring(L, file.c_str());
  lua_rawseti(L, -2, 0);
  lua_setglobal(L, "arg");
  search_script_folder(L, file);
  if (luaL_loadfilex(L, file.c_str(), "t") == LUA_OK) return run(L, 0, 0);
  const std::string message = error_text(L, -1);
  if (message.starts_with("attempt to load a binary chunk")) {
    lua_pop(L, 1);
    lua_pushstring(L, text(file, ": this is binary Lua code (bytecode); only text is run").c_str());
  }
  return false;
}

TestCounts run_file(const std::string& file) {
  const std::unique_ptr<lua_State, CloseState> state(new_state());
  lua_State* L = state.get();
  call_stdlib(L, "begin_tests", 0, 0);
  if (!load_and_run(L, file)) {
    if (is_interrupt(L, -1)) throw Interrupted();
    call_stdlib(L, "script_failed", 1, 0);
  }
  call_stdlib(L, "end_tests", 0, 2);
  return {static_cast<long>(lua_tointeger(L, -2)), static_cast<long>(lua_tointeger(L, -1))};
}

}  // namespace

int run_tests(const std::vector<std::string>& paths) {
  TestCounts total;
  try {
    std::vector<std::string> files;
    for (const std::string& path : paths) append_files(path, files);
    if (files.empty()) throw Error("pendula test: no *.lua files found");
    for (const std::string& file : files) {
      const TestCounts tally = run_file(file);
      total.passed += tally.passed;
      total.failed += tally.failed;
    }
  } catch (const Interrupted&) {
    std::fflush(stdout);
    std::fputs("pendula test: interrupted\n", stderr);
    return 130;
  } catch (const UserFacing& e) {
    std::fflush(stdout);
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
  std::printf("%ld passed, %ld failed\n", total.passed, total.failed);
  std::fflush(stdout);
  return total.failed == 0 && total.passed > 0 ? 0 : 1;
}

}  // namespace pendula::lua
