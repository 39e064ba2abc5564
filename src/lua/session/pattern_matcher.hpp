// Matching of Lua patterns by backtracking (Lua 5.4 Reference Manual §6.4.1); every step can be interrupted.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include <lua.hpp>

namespace pendula::lua {

class PatternMatcher {
 public:
  /// The views must outlive the matcher. CAUTION: both texts end in a zero byte that
  /// is no part of them, as Lua's strings do.
  PatternMatcher(lua_State* L, std::string_view source, std::string_view pattern)
      : L_(L), source_(source), pattern_end_(pattern.data() + pattern.size()), pattern_(pattern.data()) {}

  /// The end of a match that begins at `s`, or nullptr. Raises a Lua error for a malformed pattern.
  const char* match(const char* s);

  /// Pushes capture `i` of the last match from s to e; without captures, capture 0 is the match itself.
  void push_capture(int i, const char* s, const char* e) const;
  /// Pushes all captures, or the whole match if there are none and s is not nullptr; returns how many.
  int push_captures(const char* s, const char* e) const;

 private:
  static constexpr int most_captures = 32;
  static constexpr int deepest = 200;
  enum : std::ptrdiff_t { unfinished = -1, position = -2 };
  struct Capture {
    const char* begin;
    std::ptrdiff_t size;
  };

  const char* end() const { return source_.data() + source_.size(); }
  const char* follow(const char* s, const char* p);
  const char* escaped(const char* s, const char*& p, bool& handled);
  const char* class_end(const char* p) const;
  bool in_set(int c, const char* p, const char* closing) const;
  bool fits(const char* s, const char* p, const char* after) const;
  const char* balanced(const char* s, const char* p) const;
  const char* frontier(const char* s, const char*& p) const;
  const char* longest(const char* s, const char* p, const char* after);
  const char* shortest(const char* s, const char* p, const char* after);
  const char* open_capture(const char* s, const char* p, std::ptrdiff_t what);
  const char* close_capture(const char* s, const char* p);
  const char* same_as_capture(const char* s, int digit) const;

  lua_State* L_;
  std::string_view source_;
  const char* pattern_end_;
  const char* pattern_;
  int depth_ = 0;
  int level_ = 0;
  std::array<Capture, most_captures> captures_;
};

}  // namespace pendula::lua
