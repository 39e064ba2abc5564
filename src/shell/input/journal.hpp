// The entries of a running session in a file of its own, so that a session whose terminal or machine went away can be
// made again.
#pragma once

#include <string>

namespace pendula::shell {

class Journal {
 public:
  /// Begins a file beside the history; without a home, or where it cannot be written, nothing is kept.
  Journal();
  /// A session that ends by itself needs none.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const std::string& entry);

  /// The journal of a session that did not end by itself, the newest one, or "".
  static std::string left_over();

 private:
  std::string path_;
};

}  // namespace pendula::shell
