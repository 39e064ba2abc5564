#include "shell/completion/call_context.hpp"

#include <algorithm>

namespace pendula::shell {
namespace {

bool opens(const Token& token) { return token.is("(") || token.is("{") || token.is("["); }
bool closes(const Token& token) { return token.is(")") || token.is("}") || token.is("]"); }
bool separates(const Token& token) { return token.is(",") || token.is(";"); }

/// Index of the innermost bracket that is open at tokens[end], or `end` if there is none. `commas`: number of
/// commas between them.
std::size_t open_bracket(const std::vector<Token>& tokens, std::size_t end, std::size_t& commas) {
  int depth = 0;
  commas = 0;
  for (std::size_t i = end; i-- > 0;) {
    if (closes(tokens[i])) {
      ++depth;
    } else if (opens(tokens[i])) {
      if (depth-- == 0) return i;
    } else if (depth == 0 && separates(tokens[i])) {
      ++commas;
    } else if (depth == 0 && tokens[i].kind == TokenKind::keyword && !tokens[i].is("function") &&
               !tokens[i].is("end") && !tokens[i].is("not") && !tokens[i].is("nil") &&
               !tokens[i].is("true") && !tokens[i].is("false") && !tokens[i].is("and") &&
               !tokens[i].is("or")) {
      return end;  // a new statement: brackets before it do not enclose the cursor
    }
  }
  return end;
}

/// The name in `name =` or `["name"] =` before tokens[end]; "" if there is neither.
std::string key_of(const std::vector<Token>& tokens, std::size_t end) {
  if (end < 2 || !tokens[end - 1].is("=")) return "";
  std::vector<Key> path;
  if (key_before(tokens, end - 1, path) == end - 1 || path.empty()) return "";
  const auto* name = std::get_if<std::string>(&path[0]);
  return name ? *name : "";
}

/// The option whose value contains the cursor; the search ends at the comma or bracket before it.
std::string key_at(const std::vector<Token>& tokens, std::size_t open, std::size_t end) {
  int depth = 0;
  for (std::size_t i = end; i-- > open + 1;) {
    if (closes(tokens[i])) ++depth;
    if (opens(tokens[i])) --depth;
    if (depth == 0 && separates(tokens[i])) return "";
    if (depth == 0 && tokens[i].is("=")) return key_of(tokens, i + 1);
  }
  return "";
}

/// The function that is called with the bracket, string or table that begins at tokens[at].
void read_function(const std::vector<Token>& tokens, std::size_t at, CallContext& context) {
  std::vector<Key> path;
  const std::size_t begin = path_before(tokens, at, path);
  if (begin == at) return;
  context.function = path;
  if (begin >= 2 && tokens[begin - 1].is(":") && path.size() == 1) {
    const auto* method = std::get_if<std::string>(&path[0]);
    std::vector<Key> object;
    if (!method || path_before(tokens, begin - 1, object) == begin - 1) {
      context.function.clear();
      return;
    }
    context.method = *method;
    context.function = object;
  }
}

bool begins_call(const std::vector<Token>& tokens, std::size_t at) {
  if (at == 0) return false;
  const Token& before = tokens[at - 1];
  return before.kind == TokenKind::name || before.is("]") || before.is(")");
}

}  // namespace

std::size_t key_before(const std::vector<Token>& tokens, std::size_t end, std::vector<Key>& path) {
  if (end >= 1 && tokens[end - 1].kind == TokenKind::name) {
    path.insert(path.begin(), std::string(tokens[end - 1].text));
    return end - 1;
  }
  if (end < 3 || !tokens[end - 1].is("]") || !tokens[end - 3].is("[")) return end;
  const Token& literal = tokens[end - 2];
  if (literal.kind == TokenKind::string && literal.text.find('\\') == std::string_view::npos) {
    path.insert(path.begin(), std::string(literal.text.substr(1, literal.text.size() - 2)));
    return end - 3;
  }
  if (literal.kind == TokenKind::number && literal.text.size() < 10 &&
      literal.text.find_first_not_of("0123456789") == std::string_view::npos) {
    path.insert(path.begin(), std::stoll(std::string(literal.text)));
    return end - 3;
  }
  return end;
}

std::size_t path_before(const std::vector<Token>& tokens, std::size_t end, std::vector<Key>& path) {
  std::size_t begin = key_before(tokens, end, path);
  if (begin == end) return end;
  while (true) {
    const bool index = tokens[begin].is("[");
    if (!index && (begin == 0 || !tokens[begin - 1].is("."))) return begin;
    const std::size_t at = index ? begin : begin - 1;
    const std::size_t before = key_before(tokens, at, path);
    if (before == at) {
      path.clear();
      return end;
    }
    begin = before;
  }
}

CallContext call_context(const std::vector<Token>& tokens, std::size_t end) {
  CallContext context;
  std::size_t commas = 0;
  std::size_t open = open_bracket(tokens, end, commas);
  if (open == end) return context;
  context.in_table = tokens[open].is("{");
  context.at_key = context.in_table && (end == open + 1 || separates(tokens[end - 1]));
  if (context.in_table) context.key = key_at(tokens, open, end);
  for (std::size_t at = end; open != at;) {
    if (tokens[open].is("[")) return {};
    if (tokens[open].is("(") || begins_call(tokens, open)) {
      if (!begins_call(tokens, open)) return {};  // a parenthesis around an expression
      read_function(tokens, open, context);
      if (context.function.empty()) return {};
      context.argument = tokens[open].is("(") ? commas + 1 : 1;
      if (tokens[open].is("{")) context.tables.insert(context.tables.begin(), "");
      if (context.argument > 1 && tokens[open + 1].kind == TokenKind::name && separates(tokens[open + 2]))
        context.first = {std::string(tokens[open + 1].text)};
      return context;
    }
    context.tables.insert(context.tables.begin(), key_of(tokens, open));
    at = open;
    open = open_bracket(tokens, at, commas);
  }
  return {};
}

}  // namespace pendula::shell
