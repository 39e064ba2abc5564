// Long expressions in tables: the beginning says what they are, the whole is a call away.
#pragma once

#include <string>

#include "expr/print/print.hpp"

namespace pendula::dae {

/// The text of an expression, cut after `widest` characters: "x² + 2 x y + …".
inline std::string truncated_text(Expr e, std::size_t widest = 240) {
  std::string out = to_text(e);
  std::size_t characters = 0, at = 0;
  for (; at < out.size() && characters <= widest; ++at)
    if ((static_cast<unsigned char>(out[at]) & 0xC0) != 0x80) ++characters;  // not inside a UTF-8 sequence
  if (at == out.size()) return out;
  const std::size_t blank = out.rfind(' ', at);
  return out.substr(0, blank == std::string::npos ? at - 1 : blank) + " …";
}

}  // namespace pendula::dae
