#include "base/limits/stack.hpp"

#include <sys/auxv.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

#include "base/error.hpp"

namespace pendula {
namespace {

constexpr rlim_t KiB = 1024;
// The kernel leaves 128 MiB below the stack free, whatever the limit was when the program began (mmap_base in Linux,
// arch/x86/mm/mmap.c): a limit that is raised later has that much room.
constexpr rlim_t wanted = 64 * 1024 * KiB;
constexpr rlim_t largest = 1024 * 1024 * KiB;  // of "unlimited": then it is memory that ends
// What is called from the last level: GMP takes up to 64 kB and Eigen up to 128 kB for their temporaries.
constexpr rlim_t reserve = 512 * KiB;

const std::byte* const unknown = reinterpret_cast<const std::byte*>(UINTPTR_MAX);

rlim_t stack_size() {
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0) return 0;
  return std::min(limit.rlim_cur, largest);
}

/// The name of the program is the last thing that the kernel writes at the beginning of the stack.
const std::byte* stack_top() { return reinterpret_cast<const std::byte*>(getauxval(AT_EXECFN)); }

}  // namespace

constinit thread_local const std::byte* stack_floor = reinterpret_cast<const std::byte*>(-1);

void raise_stack_limit() noexcept {
#ifndef __SANITIZE_ADDRESS__  // which asks for the limit once, at the beginning
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  setrlimit(RLIMIT_STACK, &limit);
#endif
  stack_floor = unknown;
}

bool is_beyond_stack(const void* address) noexcept {
  const auto* at = static_cast<const std::byte*>(address);
  const std::byte* end = stack_top() - stack_size();
  constexpr rlim_t around = 256 * KiB;  // a large frame may reach over the end
  return at < end + around && at >= end - around;
}

void look_at_stack(const void* frame) {
  if (stack_floor == unknown) {
    const rlim_t size = stack_size();
    const bool main_thread = getpid() == gettid();
    stack_floor = main_thread && size > 0 ? stack_top() - size + std::min(reserve, size / 4) : nullptr;
  }
  if (frame >= stack_floor) return;
  throw Failure(text("nested too deeply for a stack of ", stack_size() / KiB,
                     " kB: name inner parts as unknowns of their own (w ~ ...), or give the program ",
                     "a larger stack (ulimit -s unlimited, before it starts)"));
}

}  // namespace pendula
