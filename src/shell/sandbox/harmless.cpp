#include "shell/sandbox/harmless.hpp"

#include <algorithm>
#include <cstdio>

#include "base/utf8.hpp"

namespace pendula::shell::sandbox {
unsigned code_of(std::string_view character) {
  unsigned code = static_cast<unsigned char>(character[0]);
  if (character.size() > 1) code &= 0x7FU >> character.size();
  for (char byte : character.substr(1)) code = code << 6 | (static_cast<unsigned char>(byte) & 0x3FU);
  return code;
}

bool is_obeyed(unsigned code) {
  const bool control = code < 0x20 ? code != '\n' && code != '\t' : code >= 0x7F && code < 0xA0;
  const bool direction = code == 0x61C || code == 0x200E || code == 0x200F ||
                         (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return control || direction;
}

namespace {

std::string spelled(const char* format, unsigned code) {
  char words[16];
  std::snprintf(words, sizeof words, format, code);
  return words;
}

/// Length of the UTF-8 sequence that begins with this byte, 1 if the byte begins none.
std::size_t announced(char first) {
  const auto byte = static_cast<unsigned char>(first);
  return byte < 0xC2 ? 1 : byte < 0xE0 ? 2 : byte < 0xF0 ? 3 : byte < 0xF5 ? 4 : 1;
}

}  // namespace

std::string ControlFilter::operator()(std::string_view piece) {
  kept_ += piece;
  std::string out;
  std::string_view left = kept_;
  while (!left.empty()) {
    const std::size_t length = utf8_sequence(left);
    if (length == 0 && left.size() < announced(left[0])) break;  // incomplete: the rest may follow
    if (length == 0) {
      out += spelled("\\x%02X", static_cast<unsigned char>(left[0]));
    } else if (const unsigned code = code_of(left.substr(0, length)); is_obeyed(code)) {
      out += spelled(code < 0x80 ? "\\%u" : "\\u{%X}", code);
    } else {
      out += left.substr(0, length);
    }
    left.remove_prefix(std::max<std::size_t>(length, 1));
  }
  kept_ = std::string(left);
  return out;
}

std::string ControlFilter::rest() {
  std::string out;
  for (char byte : kept_) out += spelled("\\x%02X", static_cast<unsigned char>(byte));
  kept_.clear();
  return out;
}

std::string harmless(std::string_view text) {
  ControlFilter filter;
  std::string out = filter(text);
  return out + filter.rest();
}

std::string harmless_part(std::string_view text) {
  std::string out;
  for (char c : harmless(text)) out += c == '\n' ? std::string("\n    | ") : std::string(1, c);
  return out;
}

}  // namespace pendula::shell::sandbox
