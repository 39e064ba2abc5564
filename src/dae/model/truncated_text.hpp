// Long expressions in tables: the beginning says what they are, the whole is a call away.
#pragma once

#include <algorithm>
#include <span>
#include <string>

#include "base/error.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {

/// Derivatives of high order share their parts: written out they would fill books.
constexpr double printable = 1e5;  // operations, of the expression as a tree

/// "… (812 operations)" in place of expressions that cannot be written out; "" where they can.
inline std::string unprintable(std::span<const Expr> list) {
  const bool all = std::all_of(list.begin(), list.end(), [](Expr e) { return is_short(e, printable); });
  return all ? "" : text("… (", topological(list).size(), " operations)");
}

/// The text of an expression, cut after `widest` characters: "x² + 2 x y + …".
inline std::string truncated_text(Expr e, std::size_t widest = 240) {
  if (const std::string elided = unprintable({&e, 1}); !elided.empty()) return elided;
  std::string out = to_text(e);
  std::size_t characters = 0, at = 0;
  for (; at < out.size() && characters <= widest; ++at)
    if ((static_cast<unsigned char>(out[at]) & 0xC0) != 0x80) ++characters;  // not inside a UTF-8 sequence
  if (at == out.size()) return out;
  const std::size_t blank = out.rfind(' ', at);
  return out.substr(0, blank == std::string::npos ? at - 1 : blank) + " …";
}

}  // namespace pendula::dae
