// Running what somebody else has written: in a process of its own that can compute, print, and use one folder
// at most. The kernel confines it: Landlock for files and the network, seccomp for everything that is no
// file, resource limits, an empty environment, no inherited descriptors.
//
//   parent   fork ─▶ relays what the child prints, watches time, memory and output, collects reports, kills
//   child    limits ─▶ prepare() with the files of the library still readable ─▶ confine() ─▶ work()
//
// Where the kernel has no Landlock nothing is run: weaker protection would be mistaken for this one.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace pendula::shell::sandbox {

struct Limits {
  double seconds = 10;                         ///< of processor time; four times as long by the clock
  std::size_t memory = std::size_t{1} << 30;   ///< bytes
  std::string folder;                          ///< the only folder whose files can be opened; "": none
  bool writable = true;                        ///< files in it can be written, up to 64 MiB each
  std::size_t output = std::size_t{16} << 20;  ///< bytes on standard output and error together
};

/// Throws UsageError-like std::invalid_argument with a text for the user: "10s", "500ms", "2min", "10".
double seconds_of(const std::string& words);
/// "1G", "512M", "64K", "1000000".
std::size_t bytes_of(const std::string& words);

enum class Kind { finished, error, forbidden, time, memory, output, crash, interrupted };
/// "finished", "error", …
const char* name_of(Kind kind);
/// The exit status of `pendula --safe`: 0, 1, 3, 4, 5, 6, 7, 130 in the order of Kind.
int status_of(Kind kind);

struct Outcome {
  Kind kind = Kind::crash;
  std::string message;                 ///< the error of the script, or what went wrong
  std::vector<std::string> forbidden;  ///< calls that were refused, each once, in order
  std::vector<std::string> results;    ///< what work() handed out by Reporter::result
  double processor_seconds = 0, seconds = 0;
  std::size_t memory = 0;  ///< the largest resident size, bytes
};

/// The child's line to its parent. A script cannot reach it: it has no way to name a descriptor.
class Reporter {
 public:
  explicit Reporter(int descriptor) : descriptor_(descriptor) {}
  void message(const std::string& text) { send('M', text); }  ///< of the error that ends the work
  void forbidden(const std::string& call) { send('F', call); }
  void result(const std::string& text) { send('R', text); }

 private:
  void send(char kind, const std::string& text);
  int descriptor_;
};

using Work = std::function<bool()>;  ///< true: finished; false: failed, message() was called
using Prepare = std::function<Work(Reporter&)>;
/// Output of the child: descriptor 1 or 2, bytes.
using Print = std::function<void(int, const char*, std::size_t)>;

/// Requires empty buffers of stdio. Several threads may call it. Throws Error where the
/// system cannot confine a process.
Outcome run(const Limits& limits, const Prepare& prepare, const Print& print);

/// Throws Error: Landlock is not there.
void require_confinement();

}  // namespace pendula::shell::sandbox
