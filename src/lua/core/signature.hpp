// What the signature in a row of documentation says about a call.
#pragma once

#include <string_view>

namespace pendula::lua {

/// The most arguments that any form in the signature of a row shows, the object before a colon included: 2 of
/// ("norm", "norm(v [, p]) -> scalar"), 1 of ("model:index", "sys:index() -> integer"). A large number where
/// the signature shows "…", and for metamethods, which Lua calls as it likes.
int most_arguments(std::string_view row_name, std::string_view signature);

}  // namespace pendula::lua
