#include "base/files/temporary.hpp"

#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <sys/auxv.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula {
namespace {

/// The folder shared by the program and its forked processes; named when the program starts and created with
/// the first file.
struct Folder {
  Folder() {
    const char* parent = std::getenv("TMPDIR");
    std::uint64_t random = 0;
    if (const void* bytes = reinterpret_cast<const void*>(getauxval(AT_RANDOM)))
      std::memcpy(&random, bytes, sizeof random);
    const int size =
        std::snprintf(path, sizeof path, "%s/pendula-%d-%08x", parent && *parent ? parent : "/tmp",
                      static_cast<int>(owner), static_cast<unsigned>(random ^ random >> 32));
    if (size < 0 || static_cast<std::size_t>(size) >= sizeof path) path[0] = '\0';
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { remove_temporary_files(); }

  pid_t owner = getpid();
  char path[PATH_MAX];
};
Folder folder;

/// The format of getdents64, which lists a folder without allocation.
struct Entry {
  unsigned long inode, offset;
  unsigned short size;
  unsigned char type;
  char name[1];  ///< of variable length
};

void make_folder() {
  struct stat info {};
  if (mkdir(folder.path, 0700) == 0) return;
  const int why = errno;
  const bool ours = why == EEXIST && lstat(folder.path, &info) == 0 && S_ISDIR(info.st_mode) &&
                    info.st_uid == geteuid() && (info.st_mode & 077) == 0;
  if (!ours) throw Error(text("no temporary file can be made in '", folder.path, "': ", std::strerror(why)));
}

}  // namespace

std::string temporary_file() {
  make_folder();
  std::string path = text(folder.path, "/XXXXXX");
  const int descriptor = mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) throw Error(text("no temporary file can be made: ", path, ": ", std::strerror(errno)));
  close(descriptor);
  return path;
}

void remove_temporary_files() noexcept {
  if (folder.owner != getpid()) return;
  const int descriptor = open(folder.path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return;
  alignas(Entry) char buffer[4096];
  for (long size = 1; size > 0;) {
    size = syscall(SYS_getdents64, descriptor, buffer, sizeof buffer);
    for (long at = 0; at < size;) {
      const auto* entry = reinterpret_cast<const Entry*>(buffer + at);
      unlinkat(descriptor, entry->name, 0);  // fails for "." and ".."
      at += entry->size;
    }
  }
  close(descriptor);
  rmdir(folder.path);  // fails if a script has made folders in it
}

}  // namespace pendula
