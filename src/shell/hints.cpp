#include "shell/hints.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "shell/tokens.hpp"

namespace pendula::shell {
namespace {

struct Foreign {
  std::string_view written;  ///< adjacent characters outside of strings and comments
  std::string_view remedy;
};

// Longest first where one begins like another.
constexpr std::array<Foreign, 29> foreign = {{
    {"!=", "not equal is written ~="},
    {"!", "logical not is written not"},
    {"&&", "logical and is written and"},
    {"||", "logical or is written or"},
    {"+=", "write x = x + …"},
    {"-=", "write x = x - …"},
    {"*=", "write x = x * …"},
    {"/=", "write x = x / …"},
    {"++", "write x = x + 1"},
    {"**", "a power is written ^"},
    {".*", "products and powers of matrices are written * and ^"},
    {"−", "the minus sign '−' (U+2212) is written -"},
    {"–", "the dash '–' (U+2013) is written -"},
    {"·", "the product '·' is written *"},
    {"×", "the product '×' is written *"},
    {"“", "typographic quotes are written \""},
    {"”", "typographic quotes are written \""},
    {"„", "typographic quotes are written \""},
    {"‘", "typographic quotes are written '"},
    {"’", "typographic quotes are written '"},
    {"²", "a square is written ^2"},
    {"³", "a cube is written ^3"},
    {"′", "a derivative is written x.dot or der(x)"},
    {"≤", "at most is written <=, on symbols le(a, b)"},
    {"≥", "at least is written >=, on symbols ge(a, b)"},
    {"≠", "not equal is written ~="},
    {"π", "the number π is written pi"},
    {"√", "the square root is written sqrt(x)"},
    {"\xC2\xA0", "there is a non-breaking space in this line; type it anew"},
}};

/// The line number in "chunk:12: message", or 1.
long line_of(std::string_view error) {
  for (std::size_t at = error.find(':'); at != std::string_view::npos; at = error.find(':', at + 1)) {
    const auto end = error.find_first_not_of("0123456789", at + 1);
    if (end != std::string_view::npos && end > at + 1 && error[end] == ':')
      return std::strtol(error.data() + at + 1, nullptr, 10);
  }
  return 1;
}

std::string_view foreign_at(std::string_view rest) {
  for (const Foreign& f : foreign)
    if (rest.substr(0, f.written.size()) == f.written) return f.remedy;
  return {};
}

std::string_view foreign_on(std::string_view source, long line) {
  for (const Token& token : tokenize(source)) {
    const auto before = source.substr(0, token.begin);
    if (1 + std::count(before.begin(), before.end(), '\n') != line || token.kind != TokenKind::symbol)
      continue;
    if (const auto remedy = foreign_at(source.substr(token.begin)); !remedy.empty()) return remedy;
  }
  return {};
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

}  // namespace

std::string syntax_hint(std::string_view source, std::string_view error) {
  const auto remedy = foreign_on(source, line_of(error));
  if (!remedy.empty()) return "\n  Lua: " + std::string(remedy) + ".";
  if (contains(error, "near '='"))
    return "\n  An equation is written with ~ (lhs ~ rhs), a comparison with ==.";
  if (contains(error, "near '<\\"))
    return "\n  Names are made of ASCII letters, digits and _; other letters belong in strings and comments.";
  return "";
}

}  // namespace pendula::shell
