// Turns an entry at the prompt into a chunk that Lua can run.
//
// An entry is one or several lines. It is read as an expression first (its values are echoed), then as
// statements, then as statements with an expression behind the last semicolon ("x = 2; x^2").
#pragma once

#include <lua.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace pendula::shell {

/// The chunk name of entries: error positions begin with "stdin:".
inline constexpr const char* prompt_chunk = "=stdin";

enum class Reading {
  complete,    ///< the compiled function is on the stack
  incomplete,  ///< nothing is on the stack; more lines are needed
  wrong,       ///< the syntax error, with a hint where we have one, is on the stack
};

Reading compile(lua_State* L, const std::string& entry);

/// Top-level `local x = 1` becomes `x = 1`, so that it survives its entry; line numbers are
/// kept. <const> is dropped; a <close> variable stays local and is closed when the entry
/// has run. Blocks and functions are left alone.
std::string globalize(std::string_view source);

/// Splits pasted lines into entries that run one after the other as if they had been typed, each with the
/// line breaks in front that keep its line numbers. The last one may be incomplete. A line that begins with
/// an operator continues the one before.
std::vector<std::string> pieces(lua_State* L, const std::string& entry);

/// Lines copied from a session or a book: if the first begins with the prompt, only what stands behind a
/// prompt is kept. Also drops trailing white space and the carriage returns of a paste.
std::string without_prompts(const std::string& entry);

/// The path "a.b:c" that the entry asks help for, or "": `a.b:c?`, `?a.b:c`, `help a.b:c`.
std::string help_path(std::string_view entry);

/// The Lua names of a path, "a.b:c" -> {"a", "b", "c"}; empty if it is no path.
std::vector<std::string> path_names(std::string_view path);

std::string_view trimmed(std::string_view text);

}  // namespace pendula::shell
