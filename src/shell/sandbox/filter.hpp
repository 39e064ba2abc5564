// The system calls that a confined process may make.
#pragma once

#include <string>

namespace pendula::shell::sandbox {

/// Installs the seccomp filter. Requires no_new_privs. What is not on the list fails with EPERM; a frame
/// ('S', number) goes to `report`. Throws Error where the kernel has no seccomp.
void restrict_calls(int report);

/// "execve", or "system call 59" where the number has no name here.
std::string call_name(int number);

}  // namespace pendula::shell::sandbox
