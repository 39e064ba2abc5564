// The command line.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "shell/sandbox/sandbox.hpp"

namespace pendula::shell {

struct Options {
  enum class Action { run, test, tool, version, licences, help, grade };
  Action action = Action::run;
  std::vector<std::string> code;       ///< the texts of -e, in order
  std::string script;                  ///< "": none; "-": standard input
  std::vector<std::string> arguments;  ///< behind the script, or behind the name of a tool or `test`
  std::string tool;                    ///< the file of stdlib that is run: "document/report"
  std::vector<std::string> before;     ///< what stood before the script, the program's name first
  bool interactive = false;            ///< -i
  bool colour = true;                  ///< not --no-color
  bool safe = false;                   ///< --safe
  bool json = false;                   ///< --json
  bool limited = false;                ///< one of the next was given
  sandbox::Limits limits;              ///< --time, --memory, --folder
};

/// A command line that makes no sense: exit status 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws UsageError.
Options parse_options(const std::vector<std::string>& words);

/// The text of --help.
const char* help_text();

}  // namespace pendula::shell
