// Sine and cosine of compiled programs: SLEEF's, at most 1 ulp off, whose bits are the same for one angle and
// for four at once. Where the processor or the build has no lanes, those of the C library.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pendula::codegen {

struct SinCos {
  double sin, cos;
};
SinCos sincos_value(double a);
enum class Sine { sin, cos };
/// Those of the numbers w[at[0]] … w[at[count - 1]].
void sines(Sine which, const double* w, const std::uint32_t* at, std::size_t count, double* out);

/// void f(__m256d a, double* sin, double* cos): four angles; null where there are no lanes.
const void* wide_sincos_function();
/// Require that there are.
SinCos lane_sincos(double a);
void wide_sincos(const double* a, double* sin, double* cos);

}  // namespace pendula::codegen
