#include "codegen/routines/sines.hpp"

#include <algorithm>
#include <cmath>

// not in the AVX2 file, whose instructions other processors lack
namespace pendula::codegen {

static const bool lanes = wide_sincos_function() != nullptr;

SinCos sincos_value(double a) { return lanes ? lane_sincos(a) : SinCos{std::sin(a), std::cos(a)}; }

void sines(Sine which, const double* w, const std::uint32_t* at, std::size_t count, double* out) {
  std::size_t k = 0;
  for (; lanes && k + 4 <= count; k += 4) {
    const double a[] = {w[at[k]], w[at[k + 1]], w[at[k + 2]], w[at[k + 3]]};
    double sin[4], cos[4];
    wide_sincos(a, sin, cos);
    std::copy_n(which == Sine::sin ? sin : cos, 4, out + k);
  }
  for (; k < count; ++k) {
    const SinCos both = sincos_value(w[at[k]]);
    out[k] = which == Sine::sin ? both.sin : both.cos;
  }
}

}  // namespace pendula::codegen
