#include "base/utf8.hpp"

namespace pendula {

std::size_t malformed_utf8(std::string_view s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto byte = [&](std::size_t k) { return k < s.size() ? static_cast<unsigned char>(s[k]) : 0u; };
    const unsigned lead = byte(i), next = byte(i + 1);
    const std::size_t size = lead < 0x80 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    const unsigned least = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const unsigned most = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    if (lead > 0xF4 || (lead >= 0x80 && lead < 0xC2)) return i;
    if (size > 1 && (next < least || next > most)) return i;
    for (std::size_t k = i + 2; k < i + size; ++k)
      if ((byte(k) & 0xC0u) != 0x80) return i;
    i += size;
  }
  return s.size();
}

}  // namespace pendula
