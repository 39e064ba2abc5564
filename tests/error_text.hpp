// What a user reads where a call of the library refuses.
#pragma once

#include <string>

#include "base/error.hpp"

namespace pendula::test {

/// The text of the error that the call throws, "" if it throws none.
template <class Call>
std::string error_text(const Call& call) {
  try {
    call();
  } catch (const UserFacing& e) {
    return e.what();
  }
  return "";
}

}  // namespace pendula::test
