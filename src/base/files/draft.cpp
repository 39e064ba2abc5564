#include "base/files/draft.hpp"

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.hpp"

namespace pendula {
namespace {

std::string reason() { return std::strerror(errno); }

/// The folder of a path with its slash; "" for the working directory.
std::string folder_of(const std::string& path) { return path.substr(0, path.rfind('/') + 1); }

/// The target of symbolic links; the path itself if it does not exist yet.
std::string resolved(const std::string& path) {
  const std::unique_ptr<char, decltype(&std::free)> real(realpath(path.c_str(), nullptr), std::free);
  return real ? real.get() : path;
}

/// Flushes the folder, which stores the new name.
void sync_folder(const std::string& folder) {
  const int descriptor = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

// Names of existing drafts, in a form that a signal handler can read. A slot is marked as taken once its
// name is complete.
struct Open {
  std::atomic<bool> taken = false;
  char path[PATH_MAX];
};
Open open_drafts[8];

void note_draft(const std::string& path) {
  for (Open& slot : open_drafts) {
    if (slot.taken || path.size() >= sizeof slot.path) continue;
    std::memcpy(slot.path, path.c_str(), path.size() + 1);
    slot.taken = true;
    return;
  }
}

/// Blocks signals between the creation of a draft and the registration of its name.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t held;
    sigemptyset(&held);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&held, signal);
    pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  ~SignalsHeld() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;

 private:
  sigset_t before_;
};

void forget_draft(const std::string& path) {
  for (Open& slot : open_drafts)
    if (slot.taken && path == slot.path) slot.taken = false;
}

}  // namespace

void remove_drafts() noexcept {
  for (Open& slot : open_drafts)
    if (slot.taken) unlink(slot.path);
}

Draft::Draft(const std::string& target, const char* verb) : target_(target), verb_(verb) {
  if (target.find('\0') != std::string::npos) fail("a file name cannot contain a zero byte");
  struct stat info {};
  if (stat(target.c_str(), &info) == 0) {
    if (S_ISDIR(info.st_mode)) fail("it is a folder");
    direct_ = !S_ISREG(info.st_mode);
    mode_ = info.st_mode & 07777;
    if (access(target.c_str(), W_OK) != 0) fail(reason());
  } else {
    const mode_t mask = umask(0);
    umask(mask);
    mode_ = 0666 & ~mask;
  }
  const std::string folder = folder_of(target);
  if (!folder.empty() && (stat(folder.c_str(), &info) != 0 || !S_ISDIR(info.st_mode)))
    fail("there is no folder '" + folder + "'; make it first");
  if (direct_) {
    path_ = target;
    descriptor_ = open(target.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    path_ = folder_of(resolved(target)) + ".pendula-draft-XXXXXX";
    const SignalsHeld held;
    descriptor_ = mkostemp(path_.data(), O_CLOEXEC);
    if (descriptor_ >= 0) note_draft(path_);
  }
  if (descriptor_ < 0) fail(reason());
}

Draft::~Draft() {
  if (descriptor_ >= 0) close(descriptor_);
  if (direct_ || path_.empty()) return;
  unlink(path_.c_str());
  forget_draft(path_);
}

void Draft::fail(const std::string& why) const {
  throw Error(text("cannot ", verb_, " '", target_, "': ", why));
}

bool Draft::is_empty() const {
  struct stat info {};
  return fstat(descriptor_, &info) != 0 || info.st_size == 0;
}

void Draft::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(reason());
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

void Draft::publish() {
  if (direct_) return;
  if (fchmod(descriptor_, mode_) != 0 || fsync(descriptor_) != 0) fail(reason());
  const std::string target = resolved(target_);
  if (rename(path_.c_str(), target.c_str()) != 0) fail(reason());
  forget_draft(path_);
  path_.clear();
  sync_folder(folder_of(target));
}

void write_file(const std::string& target, std::string_view bytes) {
  Draft draft(target);
  draft.write(bytes);
  draft.publish();
}

}  // namespace pendula
