#include "shell/input/history.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace pendula::shell {
namespace {

std::string escaped(const std::string& entry) {
  std::string line;
  for (char c : entry) {
    if (c == '\\')
      line += "\\\\";
    else if (c == '\n')
      line += "\\n";
    else
      line += c;
  }
  return line;
}

std::string unescaped(const std::string& line) {
  std::string entry;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size()) {
      ++i;
      entry += line[i] == 'n' ? '\n' : line[i];
    } else {
      entry += line[i];
    }
  }
  return entry;
}

/// Appends to `path`. Only the user may read the file because entries may be private.
bool append(const std::string& path, const std::string& text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (fd < 0) return false;
  const bool written = write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(fd);
  return written;
}

void rewrite(const std::string& path, const std::vector<std::string>& entries) {
  const std::string fresh = path + "." + std::to_string(getpid());
  std::string text;
  for (const auto& entry : entries) text += escaped(entry) + "\n";
  std::error_code ignored;
  if (append(fresh, text)) std::filesystem::rename(fresh, path, ignored);
  std::filesystem::remove(fresh, ignored);
}

}  // namespace

std::string history_path() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state && *state == '/') return std::string(state) + "/pendula/history";
  const char* home = std::getenv("HOME");
  return home && *home ? std::string(home) + "/.local/state/pendula/history" : "";
}

std::vector<std::string> load_history(const std::string& path, std::size_t newest) {
  std::vector<std::string> entries;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);)
    if (!line.empty()) entries.push_back(unescaped(line));
  if (entries.size() <= newest) return entries;
  const bool too_long = entries.size() > 2 * newest;
  entries.erase(entries.begin(), entries.end() - static_cast<std::ptrdiff_t>(newest));
  if (too_long) rewrite(path, entries);
  return entries;
}

void append_history(const std::string& path, const std::string& entry) {
  if (path.empty()) return;
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  append(path, escaped(entry) + "\n");
}

}  // namespace pendula::shell
