#include "base/lua_name.hpp"

#include <algorithm>

namespace pendula {

const std::vector<std::string>& lua_keywords() {
  static const std::vector<std::string> words = {
      "and", "break", "do",  "else", "elseif", "end",    "false",  "for",  "function", "goto",  "if",
      "in",  "local", "nil", "not",  "or",     "repeat", "return", "then", "true",     "until", "while"};
  return words;
}

bool is_lua_name(std::string_view word) {
  const auto is_letter = [](char c) { return (c | 0x20) >= 'a' && (c | 0x20) <= 'z'; };
  const auto is_word = [&](char c) { return is_letter(c) || c == '_' || (c >= '0' && c <= '9'); };
  const auto& keywords = lua_keywords();
  return !word.empty() && (is_letter(word[0]) || word[0] == '_') &&
         std::all_of(word.begin(), word.end(), is_word) &&
         !std::binary_search(keywords.begin(), keywords.end(), word);
}

}  // namespace pendula
