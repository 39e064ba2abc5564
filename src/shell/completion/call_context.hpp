// The call that the cursor is in: `sol:plot(s, { title = "a` is the value of the option title of a call of
// sol:plot with s as its first argument.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "lua/document/tokens.hpp"

namespace pendula::shell {

using lua::Token;
using lua::TokenKind;

/// A field of a table: a name or a number.
using Key = std::variant<std::string, long long>;

struct CallContext {
  std::vector<Key> function;  ///< rk, gauss; of a method: what stands before the colon
  std::string method;         ///< behind the colon, or ""
  std::vector<Key> first;     ///< the first argument if it is a plain name: what plot(sol, …) is about
  std::size_t argument = 0;   ///< the argument that the cursor is in, from 1; 0: no call is open
  std::vector<std::string> tables;  ///< keys of the tables around the cursor, outermost first; "" without key
  bool in_table = false;
  bool at_key = false;  ///< where an option may begin, or an entry of a list
  std::string key;      ///< the option whose value the cursor is in, or ""
};

/// tokens[0, end): what stands in front of the word at the cursor.
CallContext call_context(const std::vector<Token>& tokens, std::size_t end);

/// Reads the path that ends before tokens[end]: rk.gauss, q[1], sys. Returns the index of its first token, or
/// `end` if there is none.
std::size_t path_before(const std::vector<Token>& tokens, std::size_t end, std::vector<Key>& path);

/// Reads the key that ends before tokens[end]: `name`, or `[3]` or `["x"]` with literals. Returns its first
/// token's index, or `end` if there is none.
std::size_t key_before(const std::vector<Token>& tokens, std::size_t end, std::vector<Key>& path);

}  // namespace pendula::shell
