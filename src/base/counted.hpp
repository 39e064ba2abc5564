// A number with its noun.
#pragma once

#include "base/error.hpp"

namespace pendula {

/// "1 state", "3 states".
template <class Integer>
std::string counted(Integer n, const char* noun) {
  return text(n, " ", noun, n == 1 ? "" : "s");
}

}  // namespace pendula
