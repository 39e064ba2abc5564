// Highlighting of an entry, and the indentation of its next line.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "lua/document/tokens.hpp"
#include "shell/completion/names.hpp"

namespace pendula::shell {

enum class Style : char { plain, keyword, string, number, comment, vocabulary, own, bracket };

using NameLookup = std::function<NameKind(std::string_view name)>;

/// One style per byte of the text. Names behind a dot or colon are members and plain. The bracket at the
/// cursor, or else the one in front of it, is marked together with its partner.
std::vector<Style> highlighted(std::string_view text, std::size_t cursor, const NameLookup& kind);

/// Blanks in front of a line that follows the text: two more than the line that opens
/// the innermost block or bracket.
std::size_t indentation(std::string_view text);

/// Does the line begin with what closes a block or bracket, or with else?
bool begins_with_end(std::string_view line);

/// +1 for words that open a block, -1 for those that close one; `for` and `while` count by their `do`,
/// `elseif` by its `if`.
int block_step(const lua::Token& token);
/// The same of brackets.
int bracket_step(const lua::Token& token);

}  // namespace pendula::shell
