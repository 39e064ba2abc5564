#include "lua/core/signature.hpp"

#include <algorithm>
#include <cctype>
#include <limits>
#include <optional>

namespace pendula::lua {

namespace {

constexpr int any_number = std::numeric_limits<int>::max() / 2;

/// The number of arguments: 3 for "(a, b [, c]) -> d"; 1 for "{ … }" and "\"word\""; nothing for others.
std::optional<int> shown_arguments(std::string_view form) {
  if (form[0] == '{' || form[0] == '"' || form[0] == '[') return 1;
  if (form[0] != '(') return {};
  int depth = 0, commas = 0;
  bool quoted = false, some = false;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const char c = form[i];
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == ')' || c == '}') && --depth == 0) break;
    const bool outermost = depth == 1 && !quoted;
    // the … of a callback is not that of the call
    if (outermost && form.substr(i).starts_with("function(")) {
      i = std::min(form.find(" end", i), form.size() - 4) + 3;
      some = true;
      continue;
    }
    if (outermost && form.substr(i).starts_with("…")) return any_number;
    if (outermost && c == ',') ++commas;
    some = some || (depth > 0 && c != ' ' && c != '[' && c != ']');
    if (!quoted && (c == '(' || c == '{')) ++depth;
  }
  return some ? commas + 1 : 0;
}

bool part_of_name(char c) { return c == '_' || std::isalnum(static_cast<unsigned char>(c)); }

}  // namespace

int most_arguments(std::string_view row_name, std::string_view signature) {
  const auto separator = row_name.find_first_of(":#.");
  const std::string_view word = separator == row_name.npos ? row_name : row_name.substr(separator + 1);
  std::optional<int> most;
  for (auto at = signature.find(word); at != signature.npos; at = signature.find(word, at + 1)) {
    const auto form = signature.find_first_not_of(' ', at + word.size());
    if ((at > 0 && part_of_name(signature[at - 1])) || form == signature.npos) continue;
    most = std::max(most, shown_arguments(signature.substr(form)));  // nothing is less than 0
  }
  // Lua's own functions ignore further arguments, as in ipairs(f())
  const bool open = word.starts_with("__") || word == "ipairs";
  if (!most || *most >= any_number || open) return any_number;
  return *most + (separator != row_name.npos && row_name[separator] == ':' ? 1 : 0);
}

}  // namespace pendula::lua
