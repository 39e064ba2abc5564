#include "base/error.hpp"

#include <cstring>

namespace pendula {

void internal_error(const char* file, int line, const char* what) {
  const char* slash = std::strrchr(file, '/');
  throw std::logic_error(text(what, " [", slash ? slash + 1 : file, ":", line, "]"));
}

}  // namespace pendula
