// The events of a solution as a list that prints.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Makes the list of events on top of the stack, { { t =, which =, action =, when =, part = }, … }, print as
/// a table with a row for each event. The list stays plain data.
void make_event_list(lua_State* L);

}  // namespace pendula::lua
