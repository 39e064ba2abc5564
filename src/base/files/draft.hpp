// Files that appear complete or not at all: written beside the target, synchronised
// with the disk, renamed onto it.
//
// An error on the way (no space, a folder that is missing) leaves what was there before as it was. A target
// that is no regular file (a device, a pipe) cannot be replaced and is written to directly. A symbolic link
// stays a link: the file it leads to is replaced.
#pragma once

#include <string>
#include <string_view>

namespace pendula {

class Draft {
 public:
  /// Throws Error "cannot write 'path': why", or with another word for "write".
  explicit Draft(const std::string& target, const char* verb = "write");
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  /// Removes what was not published.
  ~Draft();

  int descriptor() const { return descriptor_; }
  /// Where a library that opens files by name writes; the draft beside the target.
  const std::string& path() const { return path_; }
  bool is_empty() const;

  /// Appends. Throws Error when the disk is full.
  void write(std::string_view bytes);
  /// Makes the draft the target. Throws Error if it is not safely on the disk.
  void publish();

 private:
  [[noreturn]] void fail(const std::string& why) const;
  std::string target_, path_;
  const char* verb_;
  int descriptor_ = -1;
  bool direct_ = false;  ///< the target is a device or a pipe
  unsigned mode_ = 0;    ///< permissions of the file that is replaced
};

/// Removes the drafts that are open. Async-signal-safe, for a handler after which the process ends.
void remove_drafts() noexcept;

/// A whole file at once.
void write_file(const std::string& target, std::string_view bytes);

}  // namespace pendula
