// C++ functions for the reports, manual and notebooks of stdlib/document.
//
// open_document adds these functions to the environment of the stdlib; scripts do not see them:
//
//   lua_tokens(source)      a list of { kind, first, last }: "name", "keyword", "number", "string", "symbol",
//                           "unfinished"; bytes outside of tokens are blanks and comments
//   embedded(name)          the bytes of a file of stdlib that is no Lua ("document/page.css")
//   base64(bytes)           their Base64 text
//   clock()                 seconds since some moment
//   capture_output(on)      begins or ends catching what is written to standard output and standard error
//   program_version         "0.3.0"
//   program_path            where the program is, "" if the system does not say
//   captured()              what was written since the last call
#pragma once

#include <lua.hpp>

namespace pendula::lua {

void open_document(lua_State* L);

}  // namespace pendula::lua
