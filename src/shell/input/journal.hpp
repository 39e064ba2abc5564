// The entries of a running session in a file of its own, so that a session whose terminal or
// machine went away can be made again.
#pragma once

#include <string>
#include <vector>

namespace pendula::shell {

class Journal {
 public:
  Journal() = default;
  ~Journal();  ///< a session that ends by itself leaves none
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Appends to a file beside the history; without a home, or where it cannot be written, nothing is kept.
  void add(const std::string& entry);

  /// The journal of the newest session that did not end by itself, or "".
  static std::string left_over();
  /// The entries of a journal, in order.
  static std::vector<std::string> entries(const std::string& path);

 private:
  int fd_ = -1;
  std::string path_;
};

}  // namespace pendula::shell
