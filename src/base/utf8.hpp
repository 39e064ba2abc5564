// Is a text well-formed UTF-8?
#pragma once

#include <cstddef>
#include <string_view>

namespace pendula {

/// The bytes of the well-formed character at the beginning: 1 … 4, or 0 if there is none (RFC 3629; Unicode
/// 15, table 3-7). Requires a text that is not empty.
std::size_t utf8_sequence(std::string_view s);

/// The place of the first byte that is no part of a well-formed character; size(): all are.
std::size_t malformed_utf8(std::string_view s);

}  // namespace pendula
