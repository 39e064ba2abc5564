#include <doctest/doctest.h>
#include <sys/resource.h>

#include <cstddef>

#include "base/error.hpp"
#include "base/limits/stack.hpp"

using namespace pendula;

namespace {

/// How many calls, each of which asks, until one is refused.
int depth(int calls) {
  constexpr int endless = 1 << 24;
  if (calls == endless) return 0;
  check_stack();
  volatile std::byte kept[256] = {};
  const int deeper = depth(calls + 1);
  return deeper + static_cast<int>(kept[0]);
}

}  // namespace

TEST_CASE("recursions that ask end with an error that says how large the stack is") {
  CHECK_THROWS_WITH_AS(depth(0), doctest::Contains("nested too deeply for a stack of"), Failure);
  CHECK_NOTHROW(check_stack());  // and the next one begins anew
}

TEST_CASE("addresses beyond the end of the stack are told from others") {
  rlimit limit{};
  REQUIRE(getrlimit(RLIMIT_STACK, &limit) == 0);
  const auto* here = static_cast<const std::byte*>(__builtin_frame_address(0));
  CHECK_FALSE(is_beyond_stack(here));
  if (limit.rlim_cur == RLIM_INFINITY) return;
  // the frame is within some hundred kB of the top, the end a stack's length below the top
  const std::byte* end = here - limit.rlim_cur;
  CHECK(is_beyond_stack(end));
  CHECK_FALSE(is_beyond_stack(end - (1 << 20)));
}
