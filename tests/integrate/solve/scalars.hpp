// Real and complex numbers for tests of both.
#pragma once

#include <type_traits>

namespace pendula::test {

/// re + i im; re alone where the type is real.
template <class Scalar>
Scalar number(double re, double im) {
  if constexpr (std::is_same_v<Scalar, double>)
    return re;
  else
    return {re, im};
}

}  // namespace pendula::test
