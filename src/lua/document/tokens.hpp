// The words of a piece of Lua, as far as the prompt and documents need them: where strings and comments end,
// which words are keywords, what the cursor stands in. It never fails: text that Lua would
// refuse becomes tokens all the same.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace pendula::lua {

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

enum class TokenKind {
  name,
  keyword,
  number,
  string,
  symbol,              ///< an operator or bracket; also any byte that begins nothing in Lua
  unfinished_string,   ///< a quoted string without its closing quote on the same line
  unfinished_long,     ///< a long string or long comment that is still open at the end
  unfinished_comment,  ///< a line comment that reaches the end of the text
};

struct Token {
  TokenKind kind;
  std::string_view text;  ///< a view into the source, quotes and brackets included
  std::size_t begin;      ///< offset in the source

  bool is(std::string_view word) const {
    return text == word && (kind == TokenKind::symbol || kind == TokenKind::keyword);
  }
};

/// Lua 5.4 Reference Manual §3.1. Comments are left out, except one that is open at the end of the text. The
/// views point into `source`.
std::vector<Token> tokenize(std::string_view source);

}  // namespace pendula::lua
