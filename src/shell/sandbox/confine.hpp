// The walls around this process. None of them can be taken down again.
#pragma once

#include "shell/sandbox/sandbox.hpp"

namespace pendula::shell::sandbox {

/// Before anything is prepared: descriptors, environment, working folder, rlimits. `report` becomes 3, and of
/// all others 0, 1 and 2 stay open.
void limit_process(const Limits& limits, int report);

/// Landlock and seccomp. A system call that is not on the list fails with EPERM, and its name goes to
/// `report`. Throws Error where a wall cannot be built.
void confine(const Limits& limits, int report);

/// 0: the kernel has no Landlock.
int landlock_version();

}  // namespace pendula::shell::sandbox
