// What the Lua stdlib needs from C++: the rows of all modules, names in and out of the vocabulary, errors at
// the user's line. Visible in the environment of stdlib chunks only.
#pragma once

#include <string>
#include <vector>

#include <lua.hpp>

namespace pendula::lua {

/// Adds the functions below to the environment of the stdlib (after open_library).
///   include "file"             runs stdlib/file.lua and returns its result
///   install(name, value)       gives a value the name of a row: "sin", "rk.gauss", "model:plot",
///   "model#energy" install_lazy(name, function) the same for an entry of a library made when it is touched
///   named(name)                what a row name stands for, or nil rows() a list of { name,
///   sig, text, example, gives, module, title } of all C++ rows members(type)              the sorted names
///   of a type's methods and fields; types() lists the types object_type(value)         "model" …, or nil if
///   the value is not one of ours did_you_mean(word, list)   " Did you mean 'x'?" or "" position()
///   "exam.lua:12: " of the user's innermost line, or "" fail(message)              an error at that position
///   width(text)                terminal columns
void open_documentation(lua_State* L);

/// The doctest of all rows, C++ and Lua: runs every example in an environment of its own and compares what it
/// prints. Returns "name: complaint" for each row whose example fails or prints something else, that is a
/// global or library function without an example, or that lacks signature or text.
std::vector<std::string> check_documentation(lua_State* L);

}  // namespace pendula::lua
