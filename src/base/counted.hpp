// A number with its noun.
#pragma once

#include "base/error.hpp"

namespace pendula {

/// "1 state", "3 states", "2 entries".
template <class Integer>
std::string counted(Integer n, const std::string& noun) {
  if (n == 1) return text(n, " ", noun);
  return noun.ends_with("y") ? text(n, " ", noun.substr(0, noun.size() - 1), "ies") : text(n, " ", noun, "s");
}

}  // namespace pendula
