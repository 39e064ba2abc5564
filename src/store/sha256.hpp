// SHA-256, for fingerprints.
#pragma once

#include <string>
#include <string_view>

namespace pendula::store {

/// 64 hexadecimal digits. Source: FIPS 180-4.
std::string sha256(std::string_view bytes);

}  // namespace pendula::store
