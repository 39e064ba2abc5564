#include "shell/input/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>

#include "shell/input/history.hpp"

namespace pendula::shell {
namespace {

namespace fs = std::filesystem;

constexpr const char* end_of_entry = "-- end of the entry";  ///< on a line of its own

fs::path folder() {
  const std::string history = history_path();
  return history.empty() ? fs::path() : fs::path(history).parent_path() / "sessions";
}

/// The session that writes a journal holds a lock on it, which the kernel releases however the process ends.
bool is_locked(const fs::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return true;
  const bool locked = flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  return locked;
}

}  // namespace

Journal::~Journal() {
  std::error_code ignored;
  if (fd_ >= 0) fs::remove(path_, ignored);
  if (fd_ >= 0) close(fd_);
}

/// The file is created with the first entry; only the user may read it.
void Journal::add(const std::string& entry) {
  if (fd_ < 0) {
    const fs::path place = folder();
    if (place.empty()) return;
    std::error_code ignored;
    fs::create_directories(place, ignored);
    path_ = (place / (std::to_string(std::time(nullptr)) + "-" + std::to_string(getpid()) + ".lua")).string();
    fd_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (fd_ >= 0) flock(fd_, LOCK_EX | LOCK_NB);
  }
  const std::string line = entry + "\n" + end_of_entry + "\n";
  // A failed write is ignored: the journal is optional and must not disturb the user.
  if (fd_ >= 0) (void)!write(fd_, line.data(), line.size());
}

std::string Journal::left_over() {
  std::error_code ignored;
  fs::path newest;
  for (const auto& entry : fs::directory_iterator(folder(), ignored))
    if (!is_locked(entry.path()) && entry.path() > newest) newest = entry.path();
  return newest.string();
}

std::vector<std::string> Journal::entries(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> all;
  std::string entry;
  for (std::string line; std::getline(file, line);) {
    if (line != end_of_entry) {
      entry += line + "\n";
      continue;
    }
    all.push_back(std::move(entry));
    entry.clear();
  }
  return all;  // text without an end mark is an entry that was only partly written
}

}  // namespace pendula::shell
