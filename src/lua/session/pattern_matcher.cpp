#include "lua/session/pattern_matcher.hpp"

#include <cctype>
#include <cstring>

#include "base/interrupt.hpp"

namespace pendula::lua {

namespace {

constexpr char escape = '%';

int code(char c) { return static_cast<unsigned char>(c); }

/// Is c in the class %letter? A capital letter negates the class; other characters match themselves.
bool in_class(int c, int letter) {
  bool in = false;
  switch (std::tolower(letter)) {
    case 'a':
      in = std::isalpha(c) != 0;
      break;
    case 'c':
      in = std::iscntrl(c) != 0;
      break;
    case 'd':
      in = std::isdigit(c) != 0;
      break;
    case 'g':
      in = std::isgraph(c) != 0;
      break;
    case 'l':
      in = std::islower(c) != 0;
      break;
    case 'p':
      in = std::ispunct(c) != 0;
      break;
    case 's':
      in = std::isspace(c) != 0;
      break;
    case 'u':
      in = std::isupper(c) != 0;
      break;
    case 'w':
      in = std::isalnum(c) != 0;
      break;
    case 'x':
      in = std::isxdigit(c) != 0;
      break;
    default:
      return letter == c;
  }
  return std::islower(letter) ? in : !in;
}

}  // namespace

const char* PatternMatcher::match(const char* s) {
  depth_ = level_ = 0;
  return follow(s, pattern_);
}

/// The end of a match of the remaining pattern p at s.
const char* PatternMatcher::follow(const char* s, const char* p) {
  struct Level {
    int& depth;
    ~Level() { --depth; }
  };
  if (depth_ >= deepest) luaL_error(L_, "pattern too complex");
  ++depth_;
  const Level level{depth_};
  while (s && p != pattern_end_) {
    poll_interrupt();
    if (*p == '(') return p[1] == ')' ? open_capture(s, p + 2, position) : open_capture(s, p + 1, unfinished);
    if (*p == ')') return close_capture(s, p + 1);
    if (*p == '$' && p + 1 == pattern_end_) return s == end() ? s : nullptr;
    if (*p == escape) {
      bool handled = false;
      s = escaped(s, p, handled);
      if (handled) continue;
    }
    const char* const after = class_end(p);
    const char repeat = *after;
    if (!fits(s, p, after)) {
      if (repeat != '*' && repeat != '?' && repeat != '-') return nullptr;
      p = after + 1;
    } else if (repeat == '?') {
      if (const char* found = follow(s + 1, after + 1)) return found;
      p = after + 1;
    } else if (repeat == '+' || repeat == '*') {
      return longest(repeat == '+' ? s + 1 : s, p, after);
    } else if (repeat == '-') {
      return shortest(s, p, after);
    } else {
      ++s, p = after;
    }
  }
  return s;
}

/// Handles %bxy, %f[set] and %1: returns the position after the match and advances p. Anything else is a
/// class and is not handled.
const char* PatternMatcher::escaped(const char* s, const char*& p, bool& handled) {
  handled = true;
  if (p[1] == 'b') {
    s = balanced(s, p + 2);
    p += 4;
    return s;
  }
  if (p[1] == 'f') {
    p += 2;
    return frontier(s, p);
  }
  if (std::isdigit(code(p[1]))) {
    s = same_as_capture(s, code(p[1]));
    p += 2;
    return s;
  }
  handled = false;
  return s;
}

/// The position after the single character class at p.
const char* PatternMatcher::class_end(const char* p) const {
  const char first = *p++;
  if (first == escape) {
    if (p == pattern_end_) luaL_error(L_, "malformed pattern (ends with '%%')");
    return p + 1;
  }
  if (first != '[') return p;
  if (*p == '^') ++p;
  do {  // the first character may be ]
    if (p == pattern_end_) luaL_error(L_, "malformed pattern (missing ']')");
    const char c = *p++;
    if (c == escape && p < pattern_end_) ++p;
  } while (*p != ']');
  return p + 1;
}

/// Is c in the set that begins at p with [ and ends at `closing`?
bool PatternMatcher::in_set(int c, const char* p, const char* closing) const {
  bool wanted = true;
  if (p[1] == '^') {
    wanted = false;
    ++p;
  }
  while (++p < closing) {
    if (*p == escape) {
      ++p;
      if (in_class(c, code(*p))) return wanted;
    } else if (p[1] == '-' && p + 2 < closing) {
      p += 2;
      if (code(p[-2]) <= c && c <= code(*p)) return wanted;
    } else if (code(*p) == c) {
      return wanted;
    }
  }
  return !wanted;
}

bool PatternMatcher::fits(const char* s, const char* p, const char* after) const {
  if (s >= end()) return false;
  const int c = code(*s);
  if (*p == '.') return true;
  if (*p == escape) return in_class(c, code(p[1]));
  if (*p == '[') return in_set(c, p, after - 1);
  return code(*p) == c;
}

const char* PatternMatcher::balanced(const char* s, const char* p) const {
  if (p >= pattern_end_ - 1) luaL_error(L_, "malformed pattern (missing arguments to '%%b')");
  if (*s != *p) return nullptr;
  const char opening = p[0], closing = p[1];
  int open = 1;
  while (++s < end()) {
    if (*s == closing) {
      if (--open == 0) return s + 1;
    } else if (*s == opening) {
      ++open;
    }
  }
  return nullptr;
}

const char* PatternMatcher::frontier(const char* s, const char*& p) const {
  if (*p != '[') luaL_error(L_, "missing '[' after '%%f' in pattern");
  const char* const after = class_end(p);
  const char before = s == source_.data() ? '\0' : s[-1];
  const bool here = !in_set(code(before), p, after - 1) && in_set(code(*s), p, after - 1);
  p = after;
  return here ? s : nullptr;
}

const char* PatternMatcher::longest(const char* s, const char* p, const char* after) {
  std::ptrdiff_t i = 0;
  while (fits(s + i, p, after)) ++i;
  for (; i >= 0; --i)
    if (const char* found = follow(s + i, after + 1)) return found;
  return nullptr;
}

const char* PatternMatcher::shortest(const char* s, const char* p, const char* after) {
  for (;; ++s) {
    if (const char* found = follow(s, after + 1)) return found;
    if (!fits(s, p, after)) return nullptr;
  }
}

const char* PatternMatcher::open_capture(const char* s, const char* p, std::ptrdiff_t what) {
  if (level_ >= most_captures) luaL_error(L_, "too many captures");
  captures_[level_++] = {s, what};
  const char* const found = follow(s, p);
  if (!found) --level_;
  return found;
}

const char* PatternMatcher::close_capture(const char* s, const char* p) {
  int open = level_ - 1;
  while (open >= 0 && captures_[open].size != unfinished) --open;
  if (open < 0) luaL_error(L_, "invalid pattern capture");
  Capture& capture = captures_[open];
  capture.size = s - capture.begin;
  const char* const found = follow(s, p);
  if (!found) capture.size = unfinished;
  return found;
}

const char* PatternMatcher::same_as_capture(const char* s, int digit) const {
  const int i = digit - '1';
  if (i < 0 || i >= level_ || captures_[i].size == unfinished)
    luaL_error(L_, "invalid capture index %%%d", i + 1);
  const Capture& capture = captures_[i];
  const auto size = static_cast<std::size_t>(capture.size);
  if (static_cast<std::size_t>(end() - s) < size || std::memcmp(capture.begin, s, size) != 0) return nullptr;
  return s + size;
}

void PatternMatcher::push_capture(int i, const char* s, const char* e) const {
  if (i >= level_) {
    if (i != 0) luaL_error(L_, "invalid capture index %%%d", i + 1);
    lua_pushlstring(L_, s, static_cast<std::size_t>(e - s));
    return;
  }
  const Capture& capture = captures_[i];
  if (capture.size == unfinished) luaL_error(L_, "unfinished capture");
  if (capture.size == position)
    lua_pushinteger(L_, capture.begin - source_.data() + 1);
  else
    lua_pushlstring(L_, capture.begin, static_cast<std::size_t>(capture.size));
}

int PatternMatcher::push_captures(const char* s, const char* e) const {
  const int count = level_ == 0 && s ? 1 : level_;
  luaL_checkstack(L_, count, "too many captures");
  for (int i = 0; i < count; ++i) push_capture(i, s, e);
  return count;
}

}  // namespace pendula::lua
