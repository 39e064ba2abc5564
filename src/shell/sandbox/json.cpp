#include "shell/sandbox/json.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "base/utf8.hpp"
#include "shell/sandbox/harmless.hpp"

namespace pendula::shell::sandbox {

static std::string escaped(unsigned code) {
  std::array<char, 16> words{};
  std::snprintf(words.data(), words.size(), "\\u%04x", code);
  return words.data();
}

std::string json_text(std::string_view bytes) {
  std::string out = "\"";
  while (!bytes.empty()) {
    const std::size_t length = utf8_sequence(bytes);
    const auto c = static_cast<unsigned char>(bytes[0]);
    if (length == 0)
      out += "\xEF\xBF\xBD";
    else if (c == '"' || c == '\\')
      out += std::string("\\") + bytes[0];
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (c < 0x20 || c == 0x7F)
      out += escaped(c);
    else if (length == 2 || length == 3) {
      const unsigned code = code_of(bytes.substr(0, length));
      out += is_obeyed(code) ? escaped(code) : std::string(bytes.substr(0, length));
    } else
      out += bytes.substr(0, length);
    bytes.remove_prefix(length == 0 ? 1 : length);
  }
  return out + "\"";
}

std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

std::string json_list(const std::vector<std::string>& entries) {
  std::string out = "[";
  for (const std::string& entry : entries) out += (out.size() > 1 ? ", " : "") + entry;
  return out + "]";
}

std::string json_object(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string out = "{";
  for (const auto& [key, value] : entries)
    out += (out.size() > 1 ? ", " : "") + json_text(key) + ": " + value;
  return out + "}";
}

}  // namespace pendula::shell::sandbox
