// The rows of all modules as data for the stdlib, which makes help(), the manual and the doctest of them.
//
// open_documentation adds these functions to the environment of the stdlib; scripts do not see them:
//
//   include "file"                runs stdlib/file.lua and returns its result
//   install(name, value)          gives a value the name of a row: "sin", "rk.gauss", "model:plot", …
//   install_lazy(name, function)  the same for an entry of a library; the function makes it when it is first
//                                 read
//   named(name)                   what a row name stands for, or nil
//   rows()                        a list of { name, sig, text, example, gives, module, title }: all C++ rows
//   options_of(name)              the rows of options of a function of C++
//   types()                       the names of all types
//   members(type)                 the sorted names of a type's methods and fields
//   object_type(value)            "model", …, or nil if the value is not one of ours
//   did_you_mean(word, list)      " Did you mean 'x'?" or ""
//   position()                    "exam.lua:12: ", the user's innermost line, or ""
//   check_options(by, options, rows)   the options (nil: none); refuses what the rows do not know or admit
//   fail(message)                 raises an error at that position
//   write_file(name, text, by)    a file that appears complete or not at all; `by` begins the error text
//   width(text)                   the columns that a text takes on a terminal
//   shown(value)                  the text that print shows
//   prose(text), block(text)      the two layouts of written texts below
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lua.hpp>

namespace pendula::lua {

void open_documentation(lua_State* L);

/// A signature or a text of a row: a line end becomes one blank together with the blanks around it.
std::string prose(std::string_view written);
/// An example or a result of a row: without the line end it begins with, the common indentation of its lines
/// and a last line of blanks. What begins with anything else stays as it is.
std::string block(std::string_view written);

/// The doctest of all rows, C++ and Lua: runs every example in an environment of its own and compares what it
/// prints. Returns "name: complaint" for each row whose example fails or prints something else, that is a
/// global or library function without an example, or that lacks signature or text.
std::vector<std::string> check_documentation(lua_State* L);

}  // namespace pendula::lua
