// The three ways in which something goes wrong, and who can do something about it.
//
//   Error     the user can fix it: names the culprit by the user's own names and says the remedy
//   Failure   the numbers refused: carries what is needed to say where (time, step, residual, equation)
//   PENDULA_ASSERT   we were wrong: "internal error … please report"
//
// All of them reach Lua through one trampoline (src/lua/core/trampoline.cpp), which prepends script and line.
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace pendula {

/// An error whose text is written for the user. Texts start with the subject, name the culprit, and end with
/// the call that fixes it.
class UserFacing : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Error : public UserFacing {
 public:
  using UserFacing::UserFacing;
};

class Failure : public UserFacing {
 public:
  using UserFacing::UserFacing;
};

/// Ctrl-C reached a native loop. Not a UserFacing: a user's pcall must not swallow it.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override { return "interrupted"; }
};

/// Joins its arguments with operator<<: `throw Error(text("row ", i, " has ", n, " entries"))`.
template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

[[noreturn]] void internal_error(const char* file, int line, const char* what);

}  // namespace pendula

/// A promise we make to ourselves. The message is for us; the user is asked to report it.
#define PENDULA_ASSERT(condition, what) \
  ((condition) ? static_cast<void>(0) : ::pendula::internal_error(__FILE__, __LINE__, what))
