// Completion at the prompt: global names and keywords, fields behind a dot, methods behind a colon, options
// and their values inside a call, file names inside quotes. Looks at values without changing them; what fails
// or takes long completes to nothing.
//
// call_context.hpp finds the call that the cursor is in, names.hpp the global names; completions.hpp is what
// the line editor gets. Options and their values are rows of the functions (stdlib/complete.lua).
#pragma once

#include <lua.hpp>

#include <string_view>

#include "shell/completion/completions.hpp"

namespace pendula::shell {

/// `text` is the entry up to the cursor.
Completions complete(lua_State* L, std::string_view text);

}  // namespace pendula::shell
