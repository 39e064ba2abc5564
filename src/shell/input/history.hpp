// The history file: one entry per line, line breaks and backslashes escaped, appended as entries are made, so
// that two sessions can run at once and a crash loses nothing.
#pragma once

#include <string>
#include <vector>

namespace pendula::shell {

/// $XDG_STATE_HOME/pendula/history, else ~/.local/state/pendula/history; "" without a home.
std::string history_path();

/// The newest entries, oldest first; shortens a file that has grown to twice
/// that number. Missing or unreadable: none.
std::vector<std::string> load_history(const std::string& path, std::size_t newest = 2000);

/// Appends in one write, creating the folders. A history that cannot be
/// written is no reason to disturb the user.
void append_history(const std::string& path, const std::string& entry);

}  // namespace pendula::shell
