// How much memory a MATLAB file can need, and a limit while a library reads it.
//
// A file says how long its arrays are, libmatio asks for the memory before it reads, and one damaged byte
// makes kilobytes gigabytes. What a file holds is at most what its bytes unpack to.
#pragma once

#include <cstdint>
#include <string>

#include <sys/resource.h>

namespace pendula::sysid {

/// Bytes of a MATLAB file, compressed elements of level 5 unpacked, which are read to their end once without
/// being kept; of files that compress otherwise (7.3) as many as deflate can make of them. Throws Error where
/// the file ends inside an element, Interrupted.
std::uintmax_t unpacked_size(const std::string& path);

/// While it lives, this process can allocate so many bytes more: beyond that malloc fails.
class MemoryLimit {
 public:
  explicit MemoryLimit(std::uintmax_t more);
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
  ~MemoryLimit();

 private:
  rlimit before_{};
  bool changed_ = false;
};

}  // namespace pendula::sysid
