// Captures the standard output and standard error of this process and of the programs it starts.
#pragma once

#include <string>

namespace pendula::lua {

/// While it lives, both descriptors lead to one file in memory; the destructor restores them. One at a time.
class Capture {
 public:
  /// Throws Failure if the system refuses.
  Capture();
  ~Capture();
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  /// The output since the last call, in order. Throws Failure.
  std::string take();

 private:
  int memory_ = -1, before_[2] = {-1, -1};
};

}  // namespace pendula::lua
