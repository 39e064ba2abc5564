// Well-formed characters are those of Unicode 15, table 3-7; its borders, and one byte beyond each.
#include <doctest/doctest.h>

#include <string>

#include "base/utf8.hpp"

namespace pendula::utf8_test {

using pendula::malformed_utf8;

namespace {

std::string encoded(unsigned code) {
  const auto byte = [](unsigned b) { return std::string(1, static_cast<char>(b)); };
  if (code < 0x80) return byte(code);
  if (code < 0x800) return byte(0xC0 | code >> 6) + byte(0x80 | (code & 0x3F));
  if (code < 0x10000)
    return byte(0xE0 | code >> 12) + byte(0x80 | (code >> 6 & 0x3F)) + byte(0x80 | (code & 0x3F));
  return byte(0xF0 | code >> 18) + byte(0x80 | (code >> 12 & 0x3F)) + byte(0x80 | (code >> 6 & 0x3F)) +
         byte(0x80 | (code & 0x3F));
}

}  // namespace

TEST_CASE("utf8: every character is well-formed, surrogates and what lies beyond are not") {
  for (unsigned code = 0; code < 0x110800; ++code) {
    const bool good = code < 0xD800 || (code > 0xDFFF && code < 0x110000);
    const std::string text = "ab" + encoded(code);
    if ((malformed_utf8(text) == text.size()) != good || (!good && malformed_utf8(text) != 2)) FAIL(code);
    if (code >= 0x80 && malformed_utf8(text.substr(0, text.size() - 1)) != 2) FAIL("cut short: ", code);
  }
}

TEST_CASE("utf8: bytes that begin nothing, and longer forms of short ones") {
  CHECK(malformed_utf8("") == 0);
  for (const std::string bad : {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xF0\x8F\xBF\xBF",
                                "\xF5\x80\x80\x80", "\xFF", "\xC3(", "\xE2\x82(", "\xF0\x9D\x84("})
    CHECK(malformed_utf8("x" + bad) == 1);
}

}  // namespace pendula::utf8_test
