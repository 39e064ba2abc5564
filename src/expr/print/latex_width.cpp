#include "expr/print/latex_width.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace pendula {

/// The width of a command in characters: three for sin; brackets and accents by their contents.
static int shown_letters(const std::string& command) {
  constexpr std::array functions{"sin",  "cos",  "tan",    "exp",    "log",   "sinh",
                                 "cosh", "tanh", "arcsin", "arccos", "arctan"};
  constexpr std::array none{"left", "right", "dot", "ddot", "dddot", "mathbf", "mathrm", "sqrt"};
  if (std::ranges::find(none, command) != none.end()) return 0;
  return std::ranges::find(functions, command) == functions.end() ? 1 : static_cast<int>(command.size());
}

std::size_t end_of_group(const std::string& s, std::size_t i) {
  for (int depth = 1; i < s.size(); ++i) {
    depth += (s[i] == '{') - (s[i] == '}');
    if (depth == 0) break;
  }
  return i;
}

int visible_width(const std::string& s) {
  int width = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const auto c = static_cast<unsigned char>(s[i]);
    if (c == '\\') {
      std::size_t end = i + 1;
      while (end < s.size() && std::isalpha(static_cast<unsigned char>(s[end]))) ++end;
      const std::string command = s.substr(i + 1, end - i - 1);
      if (command == "frac") {
        const std::size_t middle = end_of_group(s, end + 1), last = end_of_group(s, middle + 2);
        width += std::max(visible_width(s.substr(end + 1, middle - end - 1)),
                          visible_width(s.substr(middle + 2, last - middle - 2)));
        i = last;
      } else {
        width += shown_letters(command);
        i = std::max(end, i + 2) - 1;
      }
    } else if (c != '{' && c != '}' && c != '^' && c != '_' && c != ' ' && (c & 0xC0) != 0x80) {
      ++width;
    }
  }
  return width;
}

}  // namespace pendula
