// `pendula test`: runs scripted tests (stdlib/testing.lua).
#pragma once

#include <string>
#include <vector>

namespace pendula::lua {

/// Runs each path: a .lua file, or a directory searched for *.lua files (recursively, sorted, without those
/// that have a .out beside them). Every file gets a fresh state. Prints one line per failure, "file:line:
/// test: message", then "N passed, N failed". Returns the exit status: 0, 1 (something failed, or nothing was
/// run), 2 (no such path), 130 (Ctrl-C).
int run_tests(const std::vector<std::string>& paths);

}  // namespace pendula::lua
