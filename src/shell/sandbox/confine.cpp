#include "shell/sandbox/confine.hpp"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "base/error.hpp"
#include "shell/sandbox/filter.hpp"

namespace pendula::shell::sandbox {
namespace {

constexpr rlim_t MiB = rlim_t{1} << 20;
constexpr rlim_t largest_file = 64 * MiB;

void set_limit(__rlimit_resource resource, rlim_t value) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, value);
  limit.rlim_max = limit.rlim_cur;
  setrlimit(resource, &limit);
}

// The header of Debian 12 ends with version 2 of the interface; the numbers are part of the kernel's ABI.
struct Ruleset {
  std::uint64_t files, network, scope;
};
constexpr std::uint64_t first_version_files = (1U << 13) - 1, refer = 1U << 13, truncate_file = 1U << 14,
                        device_ioctl = 1U << 15;

std::uint64_t file_rights(int version) {
  std::uint64_t rights = first_version_files;
  if (version >= 2) rights |= refer;
  if (version >= 3) rights |= truncate_file;
  if (version >= 5) rights |= device_ioctl;
  return rights;
}

std::uint64_t folder_rights(int version, bool writable) {
  std::uint64_t rights = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
  if (writable)
    rights |= LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG |
              refer | truncate_file;
  return rights & file_rights(version);
}

[[noreturn]] void sandbox_failed(const char* which) {
  throw Error(text("safe mode cannot be set up: ", which, ": ", std::strerror(errno)));
}

void restrict_files(const Limits& limits) {
  const int version = landlock_version();
  const Ruleset rules{file_rights(version), version >= 4 ? 3U : 0U, version >= 6 ? 3U : 0U};
  const std::size_t size = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  const int set = static_cast<int>(syscall(SYS_landlock_create_ruleset, &rules, size, 0));
  if (set < 0) sandbox_failed("Landlock");
  if (!limits.folder.empty()) {
    // The process has already changed to the folder given by the user.
    landlock_path_beneath_attr rule{};
    rule.allowed_access = folder_rights(version, limits.writable);
    rule.parent_fd = open(".", O_PATH | O_CLOEXEC);
    if (rule.parent_fd < 0 || syscall(SYS_landlock_add_rule, set, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) != 0)
      sandbox_failed("Landlock");
    close(rule.parent_fd);
  }
  if (syscall(SYS_landlock_restrict_self, set, 0) != 0) sandbox_failed("Landlock");
  close(set);
}

}  // namespace

int landlock_version() {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return version > 0 ? static_cast<int>(version) : 0;
}

void limit_process(const Limits& limits, int report) {
  if (report != 3 && dup3(report, 3, 0) < 0) sandbox_failed("descriptors");
  if (close_range(4, ~0U, 0) != 0) sandbox_failed("descriptors");
  clearenv();
  umask(077);
  tzset();  // for os.date: reads the time zone while the file is accessible
  const std::string folder = limits.folder.empty() ? "/" : limits.folder;
  if (chdir(folder.c_str()) != 0)
    throw Error(text("the folder '", limits.folder, "' cannot be entered: ", std::strerror(errno)));
  // a second more than the limit, which the parent enforces more exactly
  set_limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.seconds)) + 1);
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_FSIZE, largest_file);
  set_limit(RLIMIT_NOFILE, 64);
  set_limit(RLIMIT_MEMLOCK, 0);
#ifndef __SANITIZE_ADDRESS__
  set_limit(RLIMIT_DATA, limits.memory);
  set_limit(RLIMIT_AS, limits.memory + 1024 * MiB);  // libraries and shared memory in addition to the data
#endif
  signal(SIGXFSZ, SIG_IGN);  // the write then fails with "File too large"
  signal(SIGPIPE, SIG_IGN);
}

void confine(const Limits& limits, int report) {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) sandbox_failed("no_new_privs");
  prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
  restrict_files(limits);
  restrict_calls(report);
}

}  // namespace pendula::shell::sandbox
