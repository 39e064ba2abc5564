// Functions removed for untrusted scripts (other programs, the debug library), and a record of attempts.
// This is for the error with its line. What holds it back is the operating system (shell/sandbox).
#pragma once

#include <functional>
#include <string>

#include <lua.hpp>

namespace pendula::lua {

/// os.execute, io.popen, io.tmpfile and os.tmpname become errors, debug is gone; io.open, io.lines, io.input,
/// io.output, dofile, os.remove and os.rename report files that the system refuses. `report` is called with
/// the name of the call and must outlive the state. Lua's blocks may sum up to `memory` bytes.
void forbid_calls(lua_State* L, const std::function<void(const std::string&)>& report, std::size_t memory);

}  // namespace pendula::lua
