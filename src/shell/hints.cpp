#include "shell/hints.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <vector>

#include "lua/document/tokens.hpp"

namespace pendula::shell {
namespace {

using lua::Token;
using lua::tokenize;
using lua::TokenKind;

struct ForeignSyntax {
  std::string_view written;  ///< adjacent characters outside of strings and comments
  std::string_view remedy;
};

// The longer of two entries with a common beginning comes first.
constexpr std::array<ForeignSyntax, 31> foreign = {{
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
    {".^", "powers are written ^"},
    {"\\", "a linear system A x = b is solved by solve(A, b)"},
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
    {"\xC2\xA0", "there is a non-breaking space in this line; type it again"},
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
  for (const ForeignSyntax& f : foreign)
    if (rest.substr(0, f.written.size()) == f.written) return f.remedy;
  return {};
}

/// The tokens of one line of the source.
std::vector<Token> tokens_on(std::string_view source, long line) {
  std::vector<Token> found;
  std::size_t counted = 0;  // line breaks before this offset are counted
  long at = 1;
  for (const Token& token : tokenize(source)) {
    at += std::count(source.begin() + static_cast<std::ptrdiff_t>(counted),
                     source.begin() + static_cast<std::ptrdiff_t>(token.begin), '\n');
    counted = token.begin;
    if (at == line) found.push_back(token);
    if (at > line) break;
  }
  return found;
}

std::string_view foreign_on(std::string_view source, const std::vector<Token>& tokens) {
  for (const Token& token : tokens) {
    if (token.kind != TokenKind::symbol) continue;
    if (const auto remedy = foreign_at(source.substr(token.begin)); !remedy.empty()) return remedy;
  }
  return {};
}

// ── syntax of other languages ──

bool is(const std::vector<Token>& tokens, std::size_t i, std::string_view text) {
  return i < tokens.size() && tokens[i].text == text;
}

bool has_word(const std::vector<Token>& tokens, std::string_view word) {
  return std::any_of(tokens.begin(), tokens.end(), [&](const Token& t) { return t.text == word; });
}

/// name . name = inside braces: { x.dot = 0 }
bool has_dotted_key(const std::vector<Token>& tokens) {
  for (std::size_t i = 0; i + 3 < tokens.size(); ++i)
    if (tokens[i].kind == TokenKind::name && is(tokens, i + 1, ".") &&
        tokens[i + 2].kind == TokenKind::name && is(tokens, i + 3, "="))
      return true;
  return false;
}

std::string_view by_first_word(const std::vector<Token>& tokens) {
  if (tokens.empty()) return {};
  const std::string_view first = tokens[0].text;
  const bool in = has_word(tokens, "in");
  if (first == "for" && (has_word(tokens, ":") || (in && !has_word(tokens, "do"))))
    return "a loop is written for i = 1, 3 do … end, over a list for i, v in ipairs(list) do … end";
  if (first == "def" || first == "fun" || (first == "function" && is(tokens, 2, "=")))
    return "a function is written function f(x) return x^2 end";
  if (first == "import" || first == "using" || first == "from")
    return "nothing has to be imported; a file of your own is run by dofile \"file.lua\"";
  if (first == "let" || first == "var" || first == "const" || first == "double" || first == "float" ||
      first == "int" || first == "Real" || first == "parameter")
    if (tokens.size() > 1 && tokens[1].kind == TokenKind::name)
      return "a local variable is written local x = 1, a symbol x = var \"x\", a parameter m = param(\"m\", 1)";
  if (first == "syms" || first == "sym" || first == "@") return "symbols are written x, y = vars \"x y\"";
  if (first == "%") return "a comment begins with --";
  if (first == "#") return "a comment begins with --";
  if (first == "!") return "cd, ls and pwd are commands; programs are run by os.execute \"…\"";
  if (first == "//" || first == "/") return "a comment begins with --, over several lines --[[ … ]]";
  if (first == "print" && tokens.size() > 1 && tokens[1].kind == TokenKind::name) return "write print(x)";
  if (first == "plot" && tokens.size() > 1 && tokens[1].kind == TokenKind::name) return "write plot(x, y)";
  if (first == "clear") return "reset() forgets the variables, x = nil one of them";
  if (first == "hold" || first == "close" || first == "clc" || first == "format")
    return "there are no commands, only calls: f(x)";
  return {};
}

std::string_view by_turn(std::string_view source, const std::vector<Token>& tokens) {
  if (has_word(tokens, "lambda") || has_word(tokens, "->") || has_word(tokens, "=>"))
    return "a function is written function(x) return x^2 end";
  for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
    const bool adjacent = tokens[i].begin + tokens[i].text.size() == tokens[i + 1].begin;
    const bool list = is(tokens, i, "[") && (i == 0 || is(tokens, i - 1, "=") || is(tokens, i - 1, "(") ||
                                             is(tokens, i - 1, ",") || is(tokens, i - 1, "["));
    if (list && !is(tokens, i + 1, "["))
      return "a list is written { 1, 2, 3 }, a column vec{1, 2, 3}, a matrix mat{{1, 2}, {3, 4}}";
    if (tokens[i].kind == TokenKind::number && tokens[i + 1].kind == TokenKind::name && adjacent)
      return "a product is written 2*x";
    if (is(tokens, i, ":") && tokens[i + 1].kind == TokenKind::number)
      return "equal steps are linspace(0, 10, 101), a loop for i = 1, 10 do … end";
    if (is(tokens, i, ":") && (is(tokens, i + 1, ",") || is(tokens, i + 1, ")")))
      return "a row of a matrix is A[1], a column A.T[1], a part A:block(1, 2, 1, 3)";
    if (is(tokens, i, "-") && is(tokens, i + 1, ">"))
      return "a function is written function(x) return x^2 end";
    if (is(tokens, i, "=") && is(tokens, i + 1, ">"))
      return "a function is written function(x) return x^2 end";
    if (is(tokens, i, "else") && is(tokens, i + 1, "if"))
      return "write elseif … then, with one end for all branches";
    if (is(tokens, i, "@") && is(tokens, i + 1, "("))
      return "a function is written function(x) return x^2 end, one of symbols fn(x, x^2)";
  }
  for (const Token& token : tokens)
    if (token.kind == TokenKind::unfinished_string && token.text[0] == '\'' && token.begin > 0 &&
        (std::isalnum(static_cast<unsigned char>(source[token.begin - 1])) ||
         source[token.begin - 1] == ')' || source[token.begin - 1] == '\'' || source[token.begin - 1] == ']'))
      return "a derivative is written x.dot or der(x), a transpose A.T";
  return {};
}

bool has_else_if(std::string_view source) {
  const auto tokens = tokenize(source);
  for (std::size_t i = 0; i + 1 < tokens.size(); ++i)
    if (is(tokens, i, "else") && is(tokens, i + 1, "if")) return true;
  return false;
}

/// Whether the token in Lua's "… near 'v'" begins a value, which hints at a missing comma or
/// operator before it.
bool value_follows(std::string_view error) {
  const auto at = error.rfind("near '");
  if (at == std::string_view::npos) return false;
  const auto near = tokenize(error.substr(at + 6));
  if (near.empty()) return false;
  const Token& token = near[0];
  return token.kind == TokenKind::name || token.kind == TokenKind::number ||
         token.kind == TokenKind::string || token.text == "{" || token.text == "function" ||
         token.text == "not";
}

std::string_view by_message(std::string_view source, std::string_view error,
                            const std::vector<Token>& tokens) {
  if (lua::contains(error, "'end' expected") && has_else_if(source))
    return "write elseif … then, with one end for all branches";
  if (lua::contains(error, "syntax error near") && has_word(tokens, "function"))
    return "a function gives its value by return: function f(x) return x^2 end";
  if (lua::contains(error, "syntax error near") && (has_word(tokens, "do") || has_word(tokens, "then")))
    return "a value alone is no statement: print(x), y = x";
  if (lua::contains(error, "syntax error near") && has_word(tokens, "="))
    return "an equation is written with ~ (lhs ~ rhs), a comparison with ==";
  if (lua::contains(error, "function arguments expected"))
    return "a method is called with ( ) or { }, as in sys:index(); a field is read with a dot, sys.kind";
  if (lua::contains(error, "malformed number")) return "a product is written 2*x";
  if (lua::contains(error, "near '='") && !has_dotted_key(tokens))
    return "an equation is written with ~ (lhs ~ rhs), a comparison with ==";
  if (lua::contains(error, "near '='"))
    return "a key that is not a plain name is written in brackets: { x = 1, [x.dot] = 0 }";
  if (lua::contains(error, "'}' expected") && value_follows(error))
    return "the entries of a list are separated by commas, and } closes it: { 1, 2 }";
  if (lua::contains(error, "')' expected") && value_follows(error))
    return "arguments are separated by commas, a product is written a*b, and ) closes a call";
  if (lua::contains(error, "']' expected near ','")) return "an entry of a matrix is A(1, 2), a row A[1]";
  if (lua::contains(error, "'then' expected")) return "a condition is written if … then … end";
  if (lua::contains(error, "'do' expected"))
    return "a loop is written while … do … end or for i = 1, 3 do … end";
  if (lua::contains(error, "near '<\\"))
    return "names are made of ASCII letters, digits and _; other letters belong in strings and comments";
  return {};
}

}  // namespace

std::string syntax_hint(std::string_view source, std::string_view error) {
  const auto tokens = tokens_on(source, line_of(error));
  for (const auto& remedy : {by_first_word(tokens), by_turn(source, tokens), foreign_on(source, tokens),
                             by_message(source, error, tokens)})
    if (!remedy.empty()) return "\n  Lua: " + std::string(remedy) + ".";
  return "";
}

}  // namespace pendula::shell
