#include "lua/document/tokens.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "base/lua_name.hpp"

namespace pendula::lua {
namespace {

// Not <cctype>, which depends on the locale, while Lua's names do not.
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(char c) { return is_letter(c) || is_digit(c); }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

bool is_keyword(std::string_view word) {
  return std::binary_search(lua_keywords().begin(), lua_keywords().end(), word);
}

constexpr std::array<std::string_view, 11> long_symbols = {
    "...", "..", "==", "~=", "<=", ">=", "//", "::", "<<", ">>", "!="};

class Scanner {
 public:
  explicit Scanner(std::string_view source) : source_(source) {}

  std::vector<Token> run() {
    while (skip_space(), at_ < source_.size()) scan();
    return std::move(tokens_);
  }

 private:
  char peek(std::size_t ahead = 0) const {
    return at_ + ahead < source_.size() ? source_[at_ + ahead] : '\0';
  }

  void skip_space() {
    while (at_ < source_.size() && is_space(source_[at_])) ++at_;
  }

  void scan() {
    const std::size_t begin = at_;
    const char c = peek();
    if (c == '-' && peek(1) == '-') return comment();
    if (is_letter(c)) return word();
    if (is_digit(c) || (c == '.' && is_digit(peek(1)))) return number();
    if (c == '"' || c == '\'') return quoted(c);
    if (const auto level = long_bracket(at_))
      return add(skip_long(*level) ? TokenKind::string : TokenKind::unfinished_long, begin);
    symbol();
  }

  void add(TokenKind kind, std::size_t begin) {
    tokens_.push_back({kind, source_.substr(begin, at_ - begin), begin});
  }

  void comment() {
    const std::size_t begin = at_;
    at_ += 2;
    if (const auto level = long_bracket(at_)) {
      if (!skip_long(*level)) add(TokenKind::unfinished_long, begin);
      return;
    }
    at_ = std::min(source_.find('\n', at_), source_.size());
    if (at_ == source_.size()) add(TokenKind::unfinished_comment, begin);
  }

  void word() {
    const std::size_t begin = at_;
    while (is_word(peek())) ++at_;
    add(is_keyword(source_.substr(begin, at_ - begin)) ? TokenKind::keyword : TokenKind::name, begin);
  }

  /// Greedy as in llex.c: 3e-2, 0x1p+4 and the malformed 1..2 are single tokens.
  void number() {
    const std::size_t begin = at_;
    const bool hexadecimal = peek() == '0' && (peek(1) == 'x' || peek(1) == 'X');
    if (hexadecimal) at_ += 2;
    for (;; ++at_) {
      const char c = peek();
      const char lower = static_cast<char>(c | 0x20);
      if (lower == (hexadecimal ? 'p' : 'e') && (peek(1) == '+' || peek(1) == '-')) {
        ++at_;
      } else if (!is_word(c) && c != '.') {
        break;
      }
    }
    add(TokenKind::number, begin);
  }

  void quoted(char quote) {
    const std::size_t begin = at_++;
    while (at_ < source_.size() && source_[at_] != quote && source_[at_] != '\n') {
      // a backslash includes the next character, even a line break; \z includes all white space
      const bool skips_space = source_[at_] == '\\' && peek(1) == 'z';
      at_ = std::min(at_ + (source_[at_] == '\\' ? 2 : 1), source_.size());
      if (skips_space) skip_space();
    }
    const bool closed = at_ < source_.size() && source_[at_] == quote;
    if (closed) ++at_;
    add(closed ? TokenKind::string : TokenKind::unfinished_string, begin);
  }

  /// The number of = signs of the long bracket that opens here, if one does.
  std::optional<int> long_bracket(std::size_t at) const {
    if (at >= source_.size() || source_[at] != '[') return {};
    std::size_t end = at + 1;
    while (end < source_.size() && source_[end] == '=') ++end;
    if (end >= source_.size() || source_[end] != '[') return {};
    return static_cast<int>(end - at - 1);
  }

  bool skip_long(int level) {
    const std::string close = "]" + std::string(static_cast<std::size_t>(level), '=') + "]";
    const std::size_t end = source_.find(close, at_ + static_cast<std::size_t>(level) + 2);
    at_ = end == std::string_view::npos ? source_.size() : end + close.size();
    return end != std::string_view::npos;
  }

  void symbol() {
    const std::size_t begin = at_;
    const auto rest = source_.substr(at_);
    const auto match = std::find_if(long_symbols.begin(), long_symbols.end(),
                                    [&](std::string_view s) { return rest.substr(0, s.size()) == s; });
    at_ += match == long_symbols.end() ? 1 : match->size();
    add(TokenKind::symbol, begin);
  }

  std::string_view source_;
  std::size_t at_ = 0;
  std::vector<Token> tokens_;
};

}  // namespace

std::vector<Token> tokenize(std::string_view source) { return Scanner(source).run(); }

}  // namespace pendula::lua
