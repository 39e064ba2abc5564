// Syntax of C, Python, MATLAB or a PDF, and its counterpart in Lua.
#pragma once

#include <string>
#include <string_view>

namespace pendula::shell {

/// A second line for a syntax error, "\n" included, or "". `error` is Lua's message "chunk:line: …"; the
/// culprit is looked for on that line of `source`.
std::string syntax_hint(std::string_view source, std::string_view error);

}  // namespace pendula::shell
