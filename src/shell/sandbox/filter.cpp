#include "shell/sandbox/filter.hpp"

#include <asm/termbits.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/error.hpp"

#ifndef __x86_64__
#error "the filter knows the system calls of x86-64 only"
#endif

namespace pendula::shell::sandbox {
namespace {

/// Memory, time, opening files as far as Landlock allows, and the end of the process.
constexpr int allowed[] = {
    SYS_read,
    SYS_write,
    SYS_readv,
    SYS_writev,
    SYS_pread64,
    SYS_pwrite64,
    SYS_open,
    SYS_openat,
    SYS_close,
    SYS_fstat,
    SYS_newfstatat,
    SYS_stat,
    SYS_lstat,
    SYS_statx,
    SYS_lseek,
    SYS_mmap,
    SYS_munmap,
    SYS_mprotect,
    SYS_mremap,
    SYS_madvise,
    SYS_brk,
    SYS_rt_sigaction,
    SYS_rt_sigreturn,
    SYS_rt_sigprocmask,
    SYS_sigaltstack,
    SYS_futex,
    SYS_clock_gettime,
    SYS_clock_nanosleep,
    SYS_nanosleep,
    SYS_gettimeofday,
    SYS_time,
    SYS_times,
    SYS_clock_getres,
    SYS_getrusage,
    SYS_sysinfo,
    SYS_getpid,
    SYS_gettid,
    SYS_getuid,
    SYS_geteuid,
    SYS_getgid,
    SYS_getegid,
    SYS_uname,
    SYS_exit,
    SYS_exit_group,
    SYS_restart_syscall,
    SYS_fsync,
    SYS_fdatasync,
    SYS_ftruncate,
    SYS_rename,
    SYS_renameat,
    SYS_renameat2,
    SYS_unlink,
    SYS_unlinkat,
    SYS_fchmod,
    SYS_umask,
    SYS_access,
    SYS_faccessat,
    SYS_faccessat2,
    SYS_readlink,
    SYS_readlinkat,
    SYS_getcwd,
    SYS_getdents64,
    SYS_fcntl,
    SYS_dup,
    SYS_poll,
    SYS_ppoll,
    SYS_sched_yield,
    SYS_getrandom,
    SYS_memfd_create,
    SYS_rseq,
    SYS_set_robust_list,
    SYS_getrlimit,
    SYS_membarrier,
    SYS_close_range,
    SYS_fadvise64,
};

/// Calls that fail with EPERM without a report to the parent because Pendula itself makes them: a sweep looks
/// for processors and starts worker processes, and manages without either.
constexpr int refused_silently[] = {SYS_sched_getaffinity,
                                    SYS_sched_setaffinity,
                                    SYS_prctl,
                                    SYS_setrlimit,
                                    SYS_clone,
                                    SYS_clone3,
                                    SYS_fork,
                                    SYS_vfork,
                                    SYS_pipe2};

struct Name {
  int number;
  const char* name;
};
constexpr Name names[] = {
    {SYS_execve, "execve"},
    {SYS_execveat, "execveat"},
    {SYS_socket, "socket"},
    {SYS_socketpair, "socketpair"},
    {SYS_connect, "connect"},
    {SYS_bind, "bind"},
    {SYS_ptrace, "ptrace"},
    {SYS_kill, "kill"},
    {SYS_tgkill, "tgkill"},
    {SYS_mount, "mount"},
    {SYS_unshare, "unshare"},
    {SYS_chmod, "chmod"},
    {SYS_mkdir, "mkdir"},
    {SYS_rmdir, "rmdir"},
    {SYS_symlink, "symlink"},
    {SYS_link, "link"},
    {SYS_ioctl, "ioctl"},
    {SYS_prlimit64, "prlimit64"},
    {SYS_chdir, "chdir"},
    {SYS_process_vm_readv, "process_vm_readv"},
    {SYS_io_uring_setup, "io_uring_setup"},
    {SYS_bpf, "bpf"},
    {SYS_perf_event_open, "perf_event_open"},
};

class Program {
 public:
  /// Allows the call if the lower half of argument `i` has this value; the upper half is ignored.
  void allow_if(int call, int i, std::uint32_t value) {
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 4);
    add(BPF_LD | BPF_W | BPF_ABS, argument(i));
    add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1);
    add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  }
  /// Allows the call if both halves of argument `i` are zero: a null pointer.
  void allow_if_null(int call, int i) {
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 6);
    add(BPF_LD | BPF_W | BPF_ABS, argument(i));
    add(BPF_JMP | BPF_JEQ | BPF_K, 0, 0, 3);
    add(BPF_LD | BPF_W | BPF_ABS, argument(i) + 4);
    add(BPF_JMP | BPF_JEQ | BPF_K, 0, 0, 1);
    add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  }
  void answer(int call, std::uint32_t action) {
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1);
    add(BPF_RET | BPF_K, action);
  }
  void begin() {
    add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch));
    add(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 1, 0);
    add(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
    add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  }
  void otherwise(std::uint32_t action) { add(BPF_RET | BPF_K, action); }
  std::vector<sock_filter>& code() { return code_; }

 private:
  static std::uint32_t argument(int i) {
    return static_cast<std::uint32_t>(offsetof(seccomp_data, args) + 8 * static_cast<std::size_t>(i));
  }
  void add(int code, std::uint32_t k, std::uint8_t yes = 0, std::uint8_t no = 0) {
    code_.push_back({static_cast<std::uint16_t>(code), yes, no, k});
  }
  std::vector<sock_filter> code_;
};

int report_descriptor = -1;

/// Reports the refused call and makes it return -EPERM. Only calls that are async-signal-safe.
extern "C" void refuse(int, siginfo_t* info, void* context) {
  const int saved = errno;
  std::array<char, 9> frame{'S', 4, 0, 0, 0};
  const int number = info->si_syscall;
  std::memcpy(frame.data() + 5, &number, sizeof number);
  (void)!write(report_descriptor, frame.data(), frame.size());
  static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RAX] = -EPERM;
  errno = saved;
}

}  // namespace

std::string call_name(int number) {
  for (const Name& n : names)
    if (n.number == number) return n.name;
  return text("system call ", number);
}

void restrict_calls(int report) {
  report_descriptor = report;
  struct sigaction action {};
  action.sa_sigaction = refuse;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  sigaction(SIGSYS, &action, nullptr);

  Program program;
  program.begin();
  for (int call : allowed) program.answer(call, SECCOMP_RET_ALLOW);
  for (int call : refused_silently) program.answer(call, SECCOMP_RET_ERRNO | EPERM);
  for (std::uint32_t request : {TCGETS, TIOCGWINSZ}) program.allow_if(SYS_ioctl, 1, request);
  program.allow_if_null(SYS_prlimit64, 2);                                // only to read a limit
  program.allow_if(SYS_tgkill, 0, static_cast<std::uint32_t>(getpid()));  // for abort()
  program.otherwise(SECCOMP_RET_TRAP);
  const sock_fprog filter{static_cast<unsigned short>(program.code().size()), program.code().data()};
  if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0)
    throw Error(text("safe mode cannot be set up: seccomp: ", std::strerror(errno)));
}

}  // namespace pendula::shell::sandbox
