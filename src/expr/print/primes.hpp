// The mark of a derivative behind a name.
#pragma once

#include <string>

namespace pendula {

/// "", "′", "″", "‴", "⁽⁴⁾", …. Requires order ≥ 0.
std::string primes(int order);

}  // namespace pendula
