// pendula --safe: scripts that somebody else has written.
#pragma once

#include <string>

#include "shell/options.hpp"
#include "shell/sandbox/sandbox.hpp"

namespace pendula::shell {

/// Runs -e and the script confined. Standard output and error are those of the script; with --json standard
/// output is one JSON object that holds them. Returns the exit status.
int run_safely(const Options& options);

/// The object of --json: outcome, message, line, forbidden, cpu_seconds, seconds, memory_bytes.
std::vector<std::pair<std::string, std::string>> json_outcome(const sandbox::Outcome& outcome);

}  // namespace pendula::shell
