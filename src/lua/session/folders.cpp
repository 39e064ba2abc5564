#include "lua/session/folders.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <lua.hpp>

#include "base/error.hpp"
#include "base/text.hpp"
#include "lua/core/library.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {
namespace {

int working_folder(lua_State* L) {
  std::error_code problem;
  const std::string path = std::filesystem::current_path(problem).string();
  if (problem) throw Error(text("pwd: ", problem.message()));
  lua_pushlstring(L, path.data(), path.size());
  return 1;
}

int change_folder(lua_State* L) {
  const std::string name = luaL_checkstring(L, 1);
  std::error_code problem;
  std::filesystem::current_path(name, problem);
  if (problem) throw Error(text("cd: '", name, "': ", problem.message()));
  return 0;
}

int folder_names(lua_State* L) {
  const std::string name = luaL_checkstring(L, 1);
  std::error_code problem;
  std::vector<std::string> names;
  for (std::filesystem::directory_iterator at(name, problem), end; !problem && at != end;
       at.increment(problem)) {
    const std::string entry = at->path().filename().string();
    std::error_code unknown;
    if (entry[0] != '.') names.push_back(at->is_directory(unknown) ? entry + "/" : entry);
  }
  if (problem) throw Error(text("ls: '", name, "': ", problem.message()));
  std::sort(names.begin(), names.end());
  lua_createtable(L, static_cast<int>(names.size()), 0);
  for (std::size_t i = 0; i < names.size(); ++i) {
    lua_pushlstring(L, names[i].data(), names[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  return 1;
}

}  // namespace

void open_folders(lua_State* L) {
  push_stdlib_environment(L);
  for (const auto& [name, function] :
       {std::pair<const char*, lua_CFunction>{"working_folder", guarded<working_folder>},
        {"change_folder", guarded<change_folder>},
        {"folder_names", guarded<folder_names>}}) {
    lua_pushcfunction(L, function);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

}  // namespace pendula::lua
