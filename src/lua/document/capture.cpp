#include "lua/document/capture.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/error.hpp"

namespace pendula::lua {
namespace {

constexpr int descriptors[] = {STDOUT_FILENO, STDERR_FILENO};

[[noreturn]] void refuse() {
  throw Failure(std::string("the output cannot be captured: ") + std::strerror(errno));
}

void flush() {
  std::fflush(stdout);
  std::fflush(stderr);
}

}  // namespace

Capture::Capture() {
  flush();
  memory_ = memfd_create("pendula-output", MFD_CLOEXEC);
  if (memory_ < 0) refuse();
  for (int i = 0; i < 2; ++i) {
    // -1 if it is closed; it is closed again at the end
    before_[i] = fcntl(descriptors[i], F_DUPFD_CLOEXEC, 3);
    if (dup2(memory_, descriptors[i]) < 0) refuse();
  }
}

Capture::~Capture() {
  flush();
  for (int i = 0; i < 2; ++i) {
    if (before_[i] < 0) {
      ::close(descriptors[i]);
      continue;
    }
    dup2(before_[i], descriptors[i]);
    ::close(before_[i]);
  }
  ::close(memory_);
}

std::string Capture::take() {
  flush();
  std::string text;
  char chunk[1 << 14];
  off_t at = 0;
  for (ssize_t n = 0; (n = pread(memory_, chunk, sizeof chunk, at)) != 0; at += n) {
    if (n < 0) refuse();
    text.append(chunk, static_cast<std::size_t>(n));
  }
  // Writers share the position of the file: the next byte goes to the beginning again.
  if (at > 0 && (lseek(memory_, 0, SEEK_SET) < 0 || ftruncate(memory_, 0) < 0)) refuse();
  return text;
}

}  // namespace pendula::lua
