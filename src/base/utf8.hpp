// Is a text well-formed UTF-8?
#pragma once

#include <cstddef>
#include <string_view>

namespace pendula {

/// The place of the first byte that is no part of a well-formed character; size(): all are. Unicode 15, table 3-7.
std::size_t malformed_utf8(std::string_view s);

}  // namespace pendula
