#include "shell/input/word_list.hpp"

#include <algorithm>
#include <array>

#include "base/lua_name.hpp"
#include "base/text.hpp"

namespace pendula::shell {
namespace {

/// The part after the last slash that is not the last character: for a file, its name in its folder.
std::string without_folder(const std::string& word) {
  if (word.size() < 2) return word;
  const auto slash = word.rfind('/', word.size() - 2);
  return slash == word.npos ? word : word.substr(slash + 1);
}

/// Column by column, each as wide as the longest word.
std::vector<std::string> in_columns(const std::vector<std::string>& words, int columns) {
  int widest = 0;
  for (const auto& word : words) widest = std::max(widest, display_width(word));
  const auto per_row = static_cast<std::size_t>(std::max(1, (columns + 1) / (widest + 2)));
  const std::size_t rows = (words.size() + per_row - 1) / per_row;
  std::vector<std::string> lines(rows);
  for (std::size_t i = 0; i < words.size(); ++i) {
    lines[i % rows] += words[i];
    if (i + rows < words.size())
      lines[i % rows] += std::string(static_cast<std::size_t>(widest + 2 - display_width(words[i])), ' ');
  }
  return lines;
}

}  // namespace

std::string word_list(std::vector<std::string> words, const NameLookup& kind, ListRoom room) {
  for (auto& word : words) word = without_folder(word);
  std::sort(words.begin(), words.end());
  struct Group {
    const char* title;
    std::vector<std::string> words;
  };
  std::array<Group, 3> groups = {{{"variables", {}}, {"vocabulary", {}}, {"keywords", {}}}};
  for (const auto& word : words) {
    const bool name = kind && is_lua_name(word);
    groups[!kind ? 0 : !name ? 2 : kind(word) == NameKind::own ? 0 : 1].words.push_back(word);
  }
  const auto used =
      std::count_if(groups.begin(), groups.end(), [](const Group& g) { return !g.words.empty(); });
  std::vector<std::string> lines;
  for (const Group& group : groups) {
    if (group.words.empty()) continue;
    if (used > 1)
      lines.push_back(room.coloured ? std::string("\033[90m") + group.title + "\033[0m" : group.title);
    for (auto& line : in_columns(group.words, room.columns)) lines.push_back(std::move(line));
  }
  const auto most = static_cast<std::size_t>(std::max(room.rows, 4));
  if (lines.size() > most) {
    lines.resize(most - 1);
    lines.push_back(std::to_string(words.size()) + " words in all; another letter makes them fewer");
  }
  return join(lines, "\r\n") + "\r\n";
}

}  // namespace pendula::shell
