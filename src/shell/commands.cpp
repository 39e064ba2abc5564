#include "shell/commands.hpp"

#include <algorithm>
#include <array>

#include "shell/completion/names.hpp"
#include "shell/entry.hpp"

namespace pendula::shell {
namespace {

/// The text as a Lua string; it may already be in quotes.
std::string quoted(std::string_view text) {
  const bool has_quotes = text.size() > 1 && (text[0] == '"' || text[0] == '\'') && text.back() == text[0];
  if (has_quotes) return std::string(text);
  std::string result = "\"";
  for (char c : text) result += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return result + "\"";
}

/// May the text be the file name after a command? False for operators that make the line Lua.
bool is_file_name(std::string_view text) {
  if (text.find('\n') != text.npos) return false;
  constexpr std::string_view operators = "=(,.:[{<>+*^%#&|";
  if (text == ".." || text.substr(0, 2) == "./" || text.substr(0, 3) == "../") return true;
  return operators.find(text[0]) == operators.npos;
}

bool is_session(std::string_view file) { return file.size() > 5 && file.substr(file.size() - 5) == ".pend"; }

std::string list_of(const std::string& folder) { return "print(ls(" + folder + "))"; }

/// Lua code that prints the duration of the body and returns the values of the body.
std::string timed(const std::string& body) {
  return "(function(seconds, ...) print(('%.3g s'):format(seconds)) return ... end)(timed(function() " +
         body + "\nend))";
}

bool reads(lua_State* L, const std::string& chunk) {
  const Reading reading = compile(L, chunk);
  if (reading != Reading::incomplete) lua_pop(L, 1);
  return reading == Reading::complete;
}

}  // namespace

Command command_of(lua_State* L, const std::string& entry) {
  const std::string text(trimmed(entry));
  const auto end = std::min(text.find_first_of(" \t\n"), text.size());
  const std::string word = text.substr(0, end);
  const std::string_view rest = trimmed(std::string_view(text).substr(end));
  constexpr std::array<std::string_view, 10> words = {"who",  "pwd",   "ls",  "cd",   "edit",
                                                      "time", "reset", "log", "save", "load"};
  if (std::find(words.begin(), words.end(), word) == words.end()) return {};
  if (name_kind(L, word) == NameKind::own) return {};
  if (rest.empty()) {
    if (word == "who" || word == "pwd") return {word + "()", ""};
    if (word == "reset") return {"reset()", "reset()"};
    if (word == "ls") return {list_of(""), ""};
    if (word == "cd") return {"cd()", "cd()"};
    return {};
  }
  if (word == "time") {
    const std::string value = timed("return " + std::string(rest));
    return {reads(L, value) ? value : timed(globalize(rest)), std::string(rest)};
  }
  if (!is_file_name(rest)) return {};
  if ((word == "save" || word == "load") && quoted(rest) != rest && is_session(rest)) {
    const std::string call = word + " " + quoted(rest);
    return {call, call};
  }
  if (word == "ls") return {list_of(quoted(rest)), ""};
  if (word == "cd") {
    const std::string call = "cd(" + quoted(rest) + ")";
    return {call, call};
  }
  if (word == "edit") {  // the record contains a call that runs the file
    const std::string file = quoted(rest);
    return {"edit(" + file + ")", file.find(".lua") == file.npos ? "" : "dofile(" + file + ")"};
  }
  if (word == "log" && rest == "off") return {"record(false)", ""};
  if (word == "log" && (quoted(rest) == rest || rest.ends_with(".lua")))
    return {"record(" + quoted(rest) + ")", ""};
  return {};
}

}  // namespace pendula::shell
