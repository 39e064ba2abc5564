// The answers of a submission: globals with the names of the tasks, and the line where each was given.
#pragma once

#include <string>
#include <vector>

#include <lua.hpp>

namespace pendula::lua {

/// From now on an assignment to one of these globals is kept apart, with its line. They read as usual.
void record_answers(lua_State* L, const std::vector<std::string>& names);

/// The assigned values, as text that the grader reads as data: an answer a line of its own, {name, line,
/// text}. A value that cannot be an answer has an empty text. Throws LuaError.
struct Answer {
  std::string name, line, text;
};
std::vector<Answer> answers(lua_State* L, const std::vector<std::string>& names);

/// A function of stdlib/grade: the arguments are strings, the results lists of strings. Throws LuaError.
std::vector<std::vector<std::string>> call_grader(lua_State* L, const std::string& function,
                                                  const std::vector<std::string>& arguments);

}  // namespace pendula::lua
