// Values of expressions: once (evaluate), or compiled (fn).
#pragma once

#include "lua/core/call.hpp"

namespace pendula::lua {

int push_evaluated(Call& call);
int push_compiled(Call& call);
int call_compiled(Call& call);
int compiled_to_string(Call& call);

}  // namespace pendula::lua
