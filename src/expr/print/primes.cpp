#include "expr/print/primes.hpp"

#include "base/text.hpp"

namespace pendula {

std::string primes(int order) {
  static constexpr const char* marks[] = {"", "′", "″", "‴"};
  return order < 4 ? marks[order] : "⁽" + superscript(order) + "⁾";
}

}  // namespace pendula
