// The Lua name of a data set, which is read as an input of a model too.
#pragma once

#include "lua/core/call.hpp"
#include "sysid/data/iddata.hpp"

namespace pendula::lua {

template <>
struct TypeName<sysid::IdData> {
  static constexpr const char* value = "iddata";
};

}  // namespace pendula::lua
