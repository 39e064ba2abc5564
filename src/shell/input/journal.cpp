#include "shell/input/journal.hpp"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include "shell/input/history.hpp"

namespace pendula::shell {
namespace {

namespace fs = std::filesystem;

fs::path folder() {
  const std::string history = history_path();
  return history.empty() ? fs::path() : fs::path(history).parent_path() / "sessions";
}

bool is_running(long process) { return kill(static_cast<pid_t>(process), 0) == 0 || errno == EPERM; }

}  // namespace

Journal::Journal() {
  const fs::path place = folder();
  if (!place.empty()) path_ = (place / (std::to_string(getpid()) + ".lua")).string();
}

Journal::~Journal() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

void Journal::add(const std::string& entry) {
  if (path_.empty()) return;
  std::error_code ignored;
  fs::create_directories(folder(), ignored);
  append_private(path_, entry + "\n");
}

std::string Journal::left_over() {
  std::error_code ignored;
  fs::path newest;
  for (const auto& entry : fs::directory_iterator(folder(), ignored)) {
    const long process = std::strtol(entry.path().stem().c_str(), nullptr, 10);
    if (process <= 0 || is_running(process)) continue;
    const bool newer =
        newest.empty() || entry.last_write_time(ignored) > fs::last_write_time(newest, ignored);
    if (newer) newest = entry.path();
  }
  return newest.string();
}

}  // namespace pendula::shell
