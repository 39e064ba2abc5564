#include "base/limits/stack.hpp"

#include <pthread.h>
#include <sys/auxv.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/error.hpp"

namespace pendula {
namespace {

constexpr rlim_t KiB = 1024;
// The kernel leaves 128 MiB below the stack free, whatever the limit at the start of the program (mmap_base
// in Linux, arch/x86/mm/mmap.c); a limit that is raised later has that much room.
constexpr rlim_t wanted = 64 * 1024 * KiB;
constexpr rlim_t largest = 1024 * 1024 * KiB;  // for "unlimited", where memory is the limit
// for calls at the deepest level: GMP uses up to 64 kB and Eigen up to 128 kB of stack for temporaries
constexpr rlim_t reserve = 512 * KiB;

rlim_t stack_size() {
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0) return 0;
  return std::min(limit.rlim_cur, largest);
}

struct Stack {
  const std::byte* end;  ///< the lowest address
  rlim_t size;           ///< 0: unknown
};

/// The stack of a thread other than the main one, or of a process forked from one.
Stack stack_of_thread() {
  pthread_attr_t attributes;
  void* end = nullptr;
  std::size_t size = 0;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return {};
  if (pthread_attr_getstack(&attributes, &end, &size) != 0) size = 0;
  pthread_attr_destroy(&attributes);
  return {static_cast<const std::byte*>(end), size};
}

/// The name of the program, which the kernel places at the very beginning of the stack.
const std::byte* stack_top() { return reinterpret_cast<const std::byte*>(getauxval(AT_EXECFN)); }

Stack stack_of(const void* frame) {
  const rlim_t size = stack_size();
  const auto* at = static_cast<const std::byte*>(frame);
  const bool is_first = at <= stack_top() && at >= stack_top() - size;
  return is_first ? Stack{stack_top() - size, size} : stack_of_thread();
}

}  // namespace

constinit thread_local std::uintptr_t stack_floor = UINTPTR_MAX;

void raise_stack_limit() noexcept {
#ifndef __SANITIZE_ADDRESS__  // which reads the limit once, at the start
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  setrlimit(RLIMIT_STACK, &limit);
#endif
  stack_floor = UINTPTR_MAX;  // to be determined
}

bool is_beyond_stack(const void* address) noexcept {
  const auto* at = static_cast<const std::byte*>(address);
  const std::byte* end = stack_top() - stack_size();
  constexpr rlim_t around = 256 * KiB;  // a large frame may extend beyond the end
  return at < end + around && at >= end - around;
}

void look_at_stack(const void* frame) {
  const Stack stack = stack_of(frame);
  const auto end = reinterpret_cast<std::uintptr_t>(stack.end);
  stack_floor = stack.size > 0 ? end + std::min(reserve, stack.size / 4) : 0;
  if (reinterpret_cast<std::uintptr_t>(frame) >= stack_floor) return;
  throw Failure(text("nested too deeply for a stack of ", stack.size / KiB,
                     " kB: name inner parts as unknowns of their own (w ~ ...), or give the program ",
                     "a larger stack (ulimit -s unlimited, before it starts)"));
}

}  // namespace pendula
