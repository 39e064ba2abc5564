#include "shell/entry.hpp"

#include <algorithm>
#include <array>

#include "base/lua_name.hpp"
#include "lua/document/tokens.hpp"
#include "shell/hints.hpp"
#include "shell/input/highlight.hpp"

namespace pendula::shell {
namespace {

using lua::Token;
using lua::tokenize;
using lua::TokenKind;

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

bool loads(lua_State* L, const std::string& source) {
  return luaL_loadbufferx(L, source.data(), source.size(), prompt_chunk, "t") == LUA_OK;
}

/// Pops the message.
std::string message(lua_State* L) {
  std::size_t length = 0;
  const char* text = lua_tolstring(L, -1, &length);
  std::string result(text ? text : "", text ? length : 0);
  lua_pop(L, 1);
  return result;
}

/// Lua reports "near <eof>" if the text ends too early. More lines do not repair three of these errors:
/// "syntax error near <eof>", where the last statement is an expression; a single line that ends with
/// ball:index; and an unfinished quoted string, unless it ends with a backslash.
bool wants_more(std::string_view entry, std::string_view error) {
  if (!ends_with(error, "near <eof>") || ends_with(error, "syntax error near <eof>")) return false;
  if (lua::contains(error, "function arguments expected") && !lua::contains(entry, "\n")) return false;
  return !lua::contains(error, "unfinished string") || ends_with(entry, "\\") || ends_with(entry, "\\z");
}

bool begins_statement(std::string_view source) {
  const auto tokens = tokenize(source);
  if (tokens.empty() || tokens[0].kind != TokenKind::keyword) return false;
  constexpr std::array<std::string_view, 4> begins_expression = {"nil", "true", "false", "not"};
  return std::find(begins_expression.begin(), begins_expression.end(), tokens[0].text) ==
         begins_expression.end();
}

/// The error message of the interpretation, expression or statement, that the user probably meant.
std::string meant(std::string_view entry, const std::string& as_expression, const std::string& as_statement) {
  if (begins_statement(entry)) return as_statement;
  constexpr std::string_view leftover = "<eof> expected";
  const auto at = as_expression.find(leftover);
  if (at == std::string::npos) return as_expression;
  if (!lua::contains(as_statement, "syntax error near")) return as_statement;
  std::string error = as_expression;  // "x y": text after a complete expression
  return error.replace(at, leftover.size(), "end of line expected");
}

/// Puts `return` after the last semicolon outside of blocks and brackets; "" if there is none.
std::string return_last(std::string_view entry) {
  int depth = 0;
  std::size_t split = 0;
  for (const Token& token : tokenize(entry)) {
    depth += block_step(token) + bracket_step(token);
    if (depth == 0 && token.is(";")) split = token.begin + 1;
  }
  if (split == 0) return "";
  return globalize(entry.substr(0, split)) + " return " + std::string(entry.substr(split));
}

/// The names of a `local` statement.
struct LocalNames {
  std::size_t end = 0;               ///< index of the first token after the names
  std::vector<std::size_t> attribs;  ///< indices of the tokens '<' name '>'
  bool closes = false;
};

/// Reads `Name [<attrib>] {, Name [<attrib>]}` from tokens[i]. end == i if there is none.
LocalNames local_names(const std::vector<Token>& tokens, std::size_t i) {
  LocalNames names;
  const auto is = [&](std::size_t k, std::string_view word) {
    return k < tokens.size() && tokens[k].is(word);
  };
  const auto is_identifier = [&](std::size_t k) {
    return k < tokens.size() && tokens[k].kind == TokenKind::name;
  };
  names.end = i;
  for (; is_identifier(i); ++i) {
    ++i;
    if (is(i, "<") && is_identifier(i + 1) && is(i + 2, ">")) {
      names.closes = names.closes || tokens[i + 1].text == "close";
      names.attribs.insert(names.attribs.end(), {i, i + 1, i + 2});
      i += 3;
    }
    names.end = i;
    if (!is(i, ",")) break;
  }
  return names;
}

void blank(std::string& text, const Token& token) {
  std::fill_n(text.begin() + static_cast<std::ptrdiff_t>(token.begin), token.text.size(), ' ');
}

/// Can a line that begins like this only be the continuation of the line before?
bool continues(std::string_view line) {
  const auto tokens = tokenize(line);
  if (tokens.empty() || tokens[0].kind == TokenKind::string) return false;
  constexpr std::array<std::string_view, 24> operators = {
      "+",  "*",   "/",  "//", "^", "%", "..", "==", "~=", "<",  "<=", ">",
      ">=", "and", "or", ".",  ":", ",", "=",  "&",  "|",  "<<", ">>", ")"};
  return std::any_of(operators.begin(), operators.end(),
                     [&](std::string_view word) { return tokens[0].is(word); });
}

/// Nothing but white space and comments?
bool is_blank(std::string_view line) {
  const auto tokens = tokenize(line);
  return tokens.empty() || tokens[0].kind == TokenKind::unfinished_comment;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    lines.push_back(text.substr(begin, end - begin));
  lines.push_back(text.substr(begin));
  return lines;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view space = " \t\r\n\v\f";
  const auto begin = text.find_first_not_of(space);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(space) - begin + 1);
}

std::string globalize(std::string_view source) {
  const auto tokens = tokenize(source);
  std::string result(source);
  std::vector<std::size_t> undefined;  // offsets after the names of `local x`, ascending
  int depth = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    depth = std::max(0, depth + block_step(tokens[i]));
    if (depth > 0 || !tokens[i].is("local")) continue;
    if (i + 1 < tokens.size() && tokens[i + 1].is("function")) {
      blank(result, tokens[i]);
      continue;
    }
    const LocalNames names = local_names(tokens, i + 1);
    if (names.end == i + 1 || names.closes) continue;
    blank(result, tokens[i]);
    for (std::size_t k : names.attribs) blank(result, tokens[k]);
    const bool assigned = names.end < tokens.size() && tokens[names.end].is("=");
    const Token& last = tokens[names.end - 1];
    if (!assigned) undefined.push_back(last.begin + last.text.size());
  }
  // The semicolon ends the assignment explicitly before a following "(f or g)()".
  for (auto at = undefined.rbegin(); at != undefined.rend(); ++at) result.insert(*at, " = nil;");
  return result;
}

Reading compile(lua_State* L, const std::string& entry) {
  const auto text = trimmed(entry);
  // "= x" is the syntax for printing in Lua 5.1 and 5.2
  const bool echo_only = !text.empty() && text[0] == '=';
  const std::string body(echo_only ? text.substr(1) : std::string_view(entry));
  if (loads(L, "return " + body)) return Reading::complete;
  const std::string as_expression = message(L);
  if (wants_more(entry, as_expression)) return Reading::incomplete;
  std::string error = as_expression;
  if (!echo_only) {
    if (loads(L, globalize(entry))) return Reading::complete;
    const std::string as_statement = message(L);
    if (wants_more(entry, as_statement)) return Reading::incomplete;
    if (const std::string both = return_last(entry); !both.empty()) {
      if (loads(L, both)) return Reading::complete;
      lua_pop(L, 1);
    }
    error = meant(entry, as_expression, as_statement);
  }
  error += syntax_hint(entry, error);
  lua_pushlstring(L, error.data(), error.size());
  return Reading::wrong;
}

std::vector<std::string> pieces(lua_State* L, const std::string& entry) {
  std::vector<std::string> result;
  Reading last = Reading::complete;
  std::size_t number = 0;
  for (const std::string& line : lines_of(entry)) {
    ++number;
    const bool goes_on = !result.empty() && (last == Reading::incomplete || continues(line));
    if (!goes_on && is_blank(line)) continue;
    if (goes_on) {
      result.back() += "\n" + line;
    } else {
      // blank lines, so that Lua counts the lines of the whole entry
      result.push_back(std::string(number - 1, '\n') + line);
    }
    last = compile(L, result.back());
    if (last != Reading::incomplete) lua_pop(L, 1);
  }
  return result;
}

std::string without_prompts(const std::string& entry) {
  std::string text = entry;
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  text.erase(text.find_last_not_of(" \t\n") + 1);
  const auto code = [](const std::string& line) -> std::string_view {
    for (std::string_view prompt : {"> ", "… "})
      if (std::string_view(line).substr(0, prompt.size()) == prompt)
        return std::string_view(line).substr(prompt.size());
    return {};
  };
  const auto lines = lines_of(text);
  if (code(lines[0]).empty()) return text;
  std::string kept;
  for (const std::string& line : lines)
    if (const auto behind = code(line); !behind.empty()) kept += std::string(behind) + "\n";
  kept.pop_back();
  return kept;
}

std::vector<std::string> path_names(std::string_view path) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find_first_of(".:", begin), path.size());
    const auto name = path.substr(begin, end - begin);
    if (!is_lua_name(name)) return {};
    names.emplace_back(name);
    begin = end + 1;
  }
  return names;
}

std::string help_path(std::string_view entry) {
  auto text = trimmed(entry);
  constexpr std::string_view word = "help ";
  if (!text.empty() && text.back() == '?') {
    text.remove_suffix(1);
  } else if (!text.empty() && text.front() == '?') {
    text.remove_prefix(1);
  } else if (text.substr(0, word.size()) == word) {
    text.remove_prefix(word.size());
  } else {
    return "";
  }
  text = trimmed(text);
  return path_names(text).empty() ? "" : std::string(text);
}

}  // namespace pendula::shell
