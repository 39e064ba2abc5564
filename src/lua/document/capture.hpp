// What this process, and the programs it starts, write to standard output and standard error.
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

  /// What has been written since the last call, in order. Throws Failure.
  std::string take();

 private:
  int memory_ = -1, before_[2] = {-1, -1};
};

}  // namespace pendula::lua
