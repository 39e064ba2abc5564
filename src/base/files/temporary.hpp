// Temporary files: in a folder of this program and the processes that it forks, which goes with all that
// is in it when the program ends.
#pragma once

#include <string>

namespace pendula {

/// The path of a new, empty file; what is written beside it (name + ".svg") goes with it. Throws
/// Error where no folder can be made.
std::string temporary_file();

/// Removes the folder, but not in a forked process. Async-signal-safe, for a handler after which the program
/// ends; an exit does it by itself.
void remove_temporary_files() noexcept;

}  // namespace pendula
