#include "shell/input/highlight.hpp"

#include <algorithm>

namespace pendula::shell {
namespace {

using lua::Token;
using lua::TokenKind;

Style style_of(const std::vector<Token>& tokens, std::size_t i, const NameLookup& kind) {
  switch (tokens[i].kind) {
    case TokenKind::keyword:
      return Style::keyword;
    case TokenKind::number:
      return Style::number;
    case TokenKind::string:
    case TokenKind::unfinished_string:
      return Style::string;
    case TokenKind::unfinished_long:
      return tokens[i].text[0] == '-' ? Style::comment : Style::string;
    case TokenKind::unfinished_comment:
      return Style::comment;
    case TokenKind::symbol:
      return Style::plain;
    case TokenKind::name:
      break;
  }
  const bool member = i > 0 && (tokens[i - 1].is(".") || tokens[i - 1].is(":"));
  if (member) return Style::plain;
  switch (kind(tokens[i].text)) {
    case NameKind::vocabulary:
      return Style::vocabulary;
    case NameKind::own:
      return Style::own;
    case NameKind::unknown:
      break;
  }
  return Style::plain;
}

bool are_partners(const Token& open, const Token& close) {
  constexpr std::string_view pairs = "()[]{}";
  return pairs.find(open.text[0]) + 1 == pairs.find(close.text[0]);
}

/// Index of the token that matches the bracket or block keyword tokens[at]; tokens.size() if there is none.
std::size_t partner(const std::vector<Token>& tokens, std::size_t at) {
  const int step = bracket_step(tokens[at]);
  int depth = 0;
  // the unsigned index wraps around below 0, which ends the loop
  for (std::size_t i = at; i < tokens.size(); i += static_cast<std::size_t>(step)) {
    depth += bracket_step(tokens[i]);
    if (depth != 0) continue;
    return are_partners(tokens[step > 0 ? at : i], tokens[step > 0 ? i : at]) ? i : tokens.size();
  }
  return tokens.size();
}

void mark_brackets(const std::vector<Token>& tokens, std::size_t cursor, std::vector<Style>& styles) {
  // cursor - 1 wraps around at 0 and then matches no token
  for (const std::size_t place : {cursor, cursor - 1}) {
    const auto token =
        std::find_if(tokens.begin(), tokens.end(), [&](const Token& t) { return t.begin == place; });
    if (token == tokens.end() || bracket_step(*token) == 0) continue;
    const std::size_t other = partner(tokens, static_cast<std::size_t>(token - tokens.begin()));
    if (other == tokens.size()) continue;
    styles[token->begin] = styles[tokens[other].begin] = Style::bracket;
    return;
  }
}

std::size_t blanks_of_line(std::string_view text, std::size_t at) {
  const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
  return std::min(text.find_first_not_of(' ', begin), text.size()) - begin;
}

}  // namespace

int block_step(const Token& token) {
  if (token.kind != TokenKind::keyword) return 0;
  for (const char* word : {"function", "do", "if", "repeat"})
    if (token.text == word) return 1;
  return token.text == "end" || token.text == "until" ? -1 : 0;
}

int bracket_step(const Token& token) {
  if (token.kind != TokenKind::symbol || token.text.size() != 1) return 0;
  if (lua::contains("([{", token.text)) return 1;
  return lua::contains(")]}", token.text) ? -1 : 0;
}

std::vector<Style> highlighted(std::string_view text, std::size_t cursor, const NameLookup& kind) {
  const auto tokens = lua::tokenize(text);
  std::vector<Style> styles(text.size(), Style::plain);
  const auto paint = [&](std::size_t begin, std::size_t end, Style style) {
    std::fill(styles.begin() + static_cast<std::ptrdiff_t>(begin),
              styles.begin() + static_cast<std::ptrdiff_t>(end), style);
  };
  std::size_t behind = 0;  // there are only blanks and comments between tokens
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (const auto comment = text.find("--", behind); comment < tokens[i].begin)
      paint(comment, tokens[i].begin, Style::comment);
    behind = tokens[i].begin + tokens[i].text.size();
    paint(tokens[i].begin, behind, style_of(tokens, i, kind));
  }
  if (const auto comment = text.find("--", behind); comment != text.npos)
    paint(comment, text.size(), Style::comment);
  mark_brackets(tokens, cursor, styles);
  return styles;
}

std::size_t indentation(std::string_view text) {
  std::vector<std::size_t> open;  // indentation of each line that opens a block or bracket not closed yet
  for (const Token& token : lua::tokenize(text)) {
    const int step = block_step(token) + bracket_step(token);
    if (step > 0) open.push_back(blanks_of_line(text, token.begin));
    if (step < 0 && !open.empty()) open.pop_back();
  }
  return open.empty() ? 0 : open.back() + 2;
}

bool begins_with_end(std::string_view line) {
  const auto tokens = lua::tokenize(line);
  if (tokens.empty()) return false;
  return block_step(tokens[0]) + bracket_step(tokens[0]) < 0 || tokens[0].is("else") ||
         tokens[0].is("elseif");
}

}  // namespace pendula::shell
