#include "lua/core/documentation.hpp"

#include <algorithm>
#include <array>
#include <sstream>
#include <string>
#include <vector>

#include "base/files/draft.hpp"
#include "base/text.hpp"
#include "lua/core/call.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/screen/fit_text.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {

namespace {

/// The result of a stdlib file; a table is cached, so that all files that include it share it.
int include_file(lua_State* L) {
  luaL_checkstring(L, 1);
  luaL_getsubtable(L, LUA_REGISTRYINDEX, "pendula.included");
  lua_pushvalue(L, 1);
  if (lua_rawget(L, -2) == LUA_TTABLE) return 1;
  lua_pop(L, 1);
  include_embedded(L, lua_tostring(L, 1));
  if (lua_istable(L, -1)) {
    lua_pushvalue(L, 1);
    lua_pushvalue(L, -2);
    lua_rawset(L, -4);
  }
  return 1;
}

/// Wraps a function written in Lua; checks the object of a method and the number of arguments. Upvalues: the
/// function, its name, its signature, the largest number of arguments (-1: not counted yet).
int function_in_lua(lua_State* L) {
  const std::string_view name = lua_tostring(L, lua_upvalueindex(2));
  const std::size_t colon = name.find(':');
  if (colon != name.npos && object_type(L, 1) != name.substr(0, colon)) {
    const std::string_view method = name.substr(colon + 1);
    throw Error(text(method, ": expected a value of type ", name.substr(0, colon),
                     " before the colon, as in x:", method, "(…), got ",
                     lua_gettop(L) > 0 ? describe(L, 1) : "nothing"));
  }
  try {
    refuse_more_arguments(L, name, lua_tostring(L, lua_upvalueindex(3)), lua_upvalueindex(4));
  } catch (const Error& e) {
    throw Error(text(shown_name(std::string(name)), ": ", e.what()));
  }
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// install(name, value [, signature]) -> the installed value
int install_value(lua_State* L) {
  const std::string_view name = luaL_checkstring(L, 1);
  luaL_checkany(L, 2);
  lua_settop(L, 3);
  if (lua_isfunction(L, 2) && name.find(":__") == name.npos) {
    lua_pushvalue(L, 2);
    lua_pushvalue(L, 1);
    lua_pushstring(L, luaL_optstring(L, 3, ""));
    lua_pushinteger(L, -1);
    lua_pushcclosure(L, guarded<function_in_lua>, 4);
    lua_replace(L, 2);
  }
  lua_settop(L, 2);
  lua_pushvalue(L, 2);
  install(L, std::string(name));
  return 1;
}

int install_loader(lua_State* L) {
  const std::string name = luaL_checkstring(L, 1);
  luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_settop(L, 2);
  install_lazy(L, name);
  return 0;
}

int named_value(lua_State* L) {
  push_named(L, luaL_checkstring(L, 1));
  return 1;
}

void push_strings(lua_State* L, const std::vector<std::string>& strings) {
  lua_createtable(L, static_cast<int>(strings.size()), 0);
  for (size_t i = 0; i < strings.size(); ++i) {
    lua_pushlstring(L, strings[i].data(), strings[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
}

/// { { name =, type =, default =, text =, values = }, … }
void push_options(lua_State* L, const OptionTable& options) {
  lua_createtable(L, static_cast<int>(options.size()), 0);
  lua_Integer n = 0;
  for (const OptionRow& option : options) {
    lua_createtable(L, 0, 5);
    for (const auto& [key, value] : {std::pair{"name", option.name},
                                     {"type", option.type},
                                     {"default", option.fallback},
                                     {"values", option.values}}) {
      lua_pushstring(L, value);
      lua_setfield(L, -2, key);
    }
    lua_pushstring(L, prose(option.text).c_str());
    lua_setfield(L, -2, "text");
    lua_rawseti(L, -2, ++n);
  }
}

int all_rows(lua_State* L) {
  lua_newtable(L);
  lua_Integer n = 0;
  for (const Module* module : added_modules(L)) {
    for (const Row& row : module->rows) {
      lua_createtable(L, 0, 8);
      const std::pair<const char*, std::string> fields[] = {
          {"name", row.name},         {"sig", prose(row.signature)}, {"text", prose(row.text)},
          {"module", module->name},   {"title", module->title},      {"example", block(row.example)},
          {"gives", block(row.gives)}};
      for (const auto& [key, value] : fields) {
        lua_pushlstring(L, value.data(), value.size());
        lua_setfield(L, -2, key);
      }
      if (row.options) {
        push_options(L, *row.options);
        lua_setfield(L, -2, "options");
      }
      lua_rawseti(L, -2, ++n);
    }
  }
  return 1;
}

/// options_of(name): the option rows of a C++ function, for use by a Lua function.
int options_of(lua_State* L) {
  const std::string_view name = luaL_checkstring(L, 1);
  for (const Module* module : added_modules(L))
    for (const Row& row : module->rows)
      if (row.name == name && row.options) {
        push_options(L, *row.options);
        return 1;
      }
  throw Error(text(name, " has no rows of options"));
}

int all_types(lua_State* L) {
  push_strings(L, type_names(L));
  return 1;
}

int members_of(lua_State* L) {
  push_strings(L, member_names(L, luaL_checkstring(L, 1)));
  return 1;
}

int type_of(lua_State* L) {
  const std::string type = object_type(L, 1);
  if (type.empty()) return 0;
  lua_pushlstring(L, type.data(), type.size());
  return 1;
}

int nearest(lua_State* L) {
  const std::string word = luaL_checkstring(L, 1);
  luaL_checktype(L, 2, LUA_TTABLE);
  std::vector<std::string> candidates;
  for (lua_Integer i = 1; lua_rawgeti(L, 2, i) == LUA_TSTRING; ++i) {
    candidates.emplace_back(lua_tostring(L, -1));
    lua_pop(L, 1);
  }
  const std::string hint = did_you_mean(word, candidates);
  lua_pushlstring(L, hint.data(), hint.size());
  return 1;
}

int position(lua_State* L) {
  const std::string where = user_position(L);
  lua_pushlstring(L, where.data(), where.size());
  return 1;
}

int write_whole_file(lua_State* L) {
  std::size_t name_size = 0, size = 0;
  const char* name = luaL_checklstring(L, 1, &name_size);
  const char* bytes = luaL_checklstring(L, 2, &size);
  try {
    write_file({name, name_size}, {bytes, size});
  } catch (const Error& e) {
    throw Error(text(luaL_checkstring(L, 3), ": ", e.what()));
  }
  return 0;
}

int fail(lua_State* L) { throw Error(error_text(L, 1)); }

std::string field(lua_State* L, int table, const char* key) {
  const bool there = lua_getfield(L, table, key) == LUA_TSTRING;
  const std::string value = there ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  return value;
}

/// The words of a row "acc|ggl".
std::vector<std::string> words_of(const std::string& values) {
  std::vector<std::string> words;
  std::istringstream parts(values);
  for (std::string word; std::getline(parts, word, '|');) words.push_back(word);
  return words;
}

/// Checks that a text is one of the words of its row.
void check_word(const OptionRow& row, const std::string& given) {
  const std::vector<std::string> words = words_of(row.values);
  if (std::string_view(row.type) != "string" || words.empty() || words[0][0] == '@' ||
      std::find(words.begin(), words.end(), given) != words.end())
    return;
  throw Error(text("option '", row.name, "' must be \"", join(words, "\" or \""), "\", not \"", given, "\".",
                   did_you_mean(given, words)));
}

/// check_options(by, options, rows)
int checked_table(lua_State* L) {
  const std::string by = luaL_checkstring(L, 1);
  luaL_checktype(L, 3, LUA_TTABLE);
  lua_settop(L, 3);
  if (lua_isnil(L, 2)) {
    lua_newtable(L);
    return 1;
  }
  const auto count = static_cast<lua_Integer>(lua_rawlen(L, 3));
  std::vector<std::array<std::string, 4>> texts;
  for (lua_Integer i = 1; i <= count; ++i, lua_settop(L, 3)) {
    lua_rawgeti(L, 3, i);
    texts.push_back({field(L, 4, "name"), field(L, 4, "type"), field(L, 4, "text"), field(L, 4, "values")});
  }
  if (!lua_istable(L, 2))
    throw Error(text(by, ": options are a table { ", texts.empty() ? "name" : texts[0][0], " = … }, not ",
                     describe(L, 2)));
  OptionTable rows;
  for (const auto& [name, type, meaning, values] : texts)
    rows.push_back({name.c_str(), type.c_str(), "", meaning.c_str(), values.c_str()});
  try {
    check_options(L, 2, rows);
    for (const OptionRow& row : rows) {  // some functions have more rows than the Lua stack has free slots
      if (lua_getfield(L, 2, row.name) == LUA_TSTRING) check_word(row, lua_tostring(L, -1));
      lua_pop(L, 1);
    }
  } catch (const Error& e) {
    throw Error(text(by, ": ", e.what()));
  }
  lua_settop(L, 2);
  return 1;
}

int load_check(lua_State* L) {
  include_embedded(L, "doc_check");
  return 1;
}

template <std::string (*layout)(std::string_view)>
int laid_out(lua_State* L) {
  size_t size = 0;
  const char* bytes = luaL_checklstring(L, 1, &size);
  const std::string result = layout({bytes, size});
  lua_pushlstring(L, result.data(), result.size());
  return 1;
}

int shown_value(lua_State* L) {
  const std::string shown = shown_text(L, 1);
  lua_pushlstring(L, shown.data(), shown.size());
  return 1;
}

/// The bytecode of a Lua function and its plain upvalues, for fingerprints.
int function_bytes(lua_State* L) {
  std::string bytes;
  const auto write = [](lua_State*, const void* piece, size_t size, void* to) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(piece), size);
    return 0;
  };
  lua_settop(L, 1);
  if (lua_iscfunction(L, 1) || lua_dump(L, write, &bytes, 1) != 0)
    throw Error("a function of the library itself has no source text");
  for (int i = 1; lua_getupvalue(L, 1, i); ++i) {
    const int type = lua_type(L, -1);
    if (type == LUA_TNUMBER || type == LUA_TSTRING || type == LUA_TBOOLEAN)
      bytes += luaL_tolstring(L, -1, nullptr);
    lua_settop(L, 1);
  }
  lua_pushlstring(L, bytes.data(), bytes.size());
  return 1;
}

int columns(lua_State* L) {
  size_t size = 0;
  const char* bytes = luaL_checklstring(L, 1, &size);
  lua_pushinteger(L, display_width({bytes, size}));
  return 1;
}

/// page(text): fits a text to the screen and shows it, screen by screen if a user waits at the prompt.
int page(lua_State* L) {
  std::size_t size = 0;
  const char* bytes = luaL_checklstring(L, 1, &size);
  show_text(fitted({bytes, size}, screen_size().columns));
  return 0;
}

/// The number of columns of the terminal on standard output; 0 if it is none.
int screen_width(lua_State* L) {
  lua_pushinteger(L, screen_size().columns);
  return 1;
}

}  // namespace

void open_documentation(lua_State* L) {
  const std::pair<const char*, lua_CFunction> functions[] = {{"include", guarded<include_file>},
                                                             {"install", guarded<install_value>},
                                                             {"install_lazy", guarded<install_loader>},
                                                             {"named", guarded<named_value>},
                                                             {"rows", guarded<all_rows>},
                                                             {"options_of", guarded<options_of>},
                                                             {"types", guarded<all_types>},
                                                             {"members", guarded<members_of>},
                                                             {"object_type", guarded<type_of>},
                                                             {"did_you_mean", guarded<nearest>},
                                                             {"position", guarded<position>},
                                                             {"fail", guarded<fail>},
                                                             {"check_options", guarded<checked_table>},
                                                             {"width", guarded<columns>},
                                                             {"write_file", guarded<write_whole_file>},
                                                             {"prose", guarded<laid_out<prose>>},
                                                             {"function_bytes", guarded<function_bytes>},
                                                             {"shown", guarded<shown_value>},
                                                             {"page", guarded<page>},
                                                             {"screen_width", guarded<screen_width>},
                                                             {"block", guarded<laid_out<block>>}};
  push_stdlib_environment(L);
  for (const auto& [name, function] : functions) {
    lua_pushcfunction(L, function);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

std::string prose(std::string_view written) {
  std::string words;
  for (std::size_t i = 0; i < written.size();) {
    const std::size_t gap = std::min(written.find_first_not_of(" \n", i), written.size()) - i;
    const std::string_view blanks = written.substr(i, gap);
    if (blanks.find('\n') == blanks.npos)
      words += blanks;
    else if (!words.empty() && i + gap < written.size())
      words += ' ';
    i += gap;
    const std::size_t word = std::min(written.find_first_of(" \n", i), written.size()) - i;
    words += written.substr(i, word);
    i += word;
  }
  return words;
}

std::string block(std::string_view written) {
  if (!written.starts_with('\n')) return std::string(written);
  std::vector<std::string_view> lines;
  std::size_t indentation = written.size();
  for (std::string_view rest = written; !rest.empty();) {
    rest.remove_prefix(1);
    const std::string_view line = rest.substr(0, rest.find('\n'));
    const std::size_t blanks = line.find_first_not_of(' ');
    if (blanks != line.npos) indentation = std::min(indentation, blanks);
    lines.push_back(line);
    rest.remove_prefix(line.size());
  }
  if (lines.back().find_first_not_of(' ') == std::string_view::npos) lines.pop_back();
  std::string joined;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) joined += '\n';
    joined += lines[i].substr(std::min(indentation, lines[i].size()));
  }
  return joined;
}

std::vector<std::string> check_documentation(lua_State* L) {
  lua_pushcfunction(L, guarded<load_check>);
  protected_call(L, 0, 1);
  protected_call(L, 0, 1);
  std::vector<std::string> complaints;
  for (lua_Integer i = 1; lua_rawgeti(L, -1, i) == LUA_TSTRING; ++i) {
    complaints.emplace_back(lua_tostring(L, -1));
    lua_pop(L, 1);
  }
  lua_pop(L, 2);
  return complaints;
}

}  // namespace pendula::lua
