// SLEEF's functions for four AVX2 lanes, by operation. This file alone is compiled for AVX2: it defines
// nothing that other files could share.
#include "codegen/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include <immintrin.h>
#include <sleef.h>

namespace pendula::codegen {

const void* lane_function(Op op) {
  switch (op) {
    case Op::sin:
      return reinterpret_cast<const void*>(Sleef_sind4_u10avx2);
    case Op::cos:
      return reinterpret_cast<const void*>(Sleef_cosd4_u10avx2);
    case Op::tan:
      return reinterpret_cast<const void*>(Sleef_tand4_u10avx2);
    case Op::asin:
      return reinterpret_cast<const void*>(Sleef_asind4_u10avx2);
    case Op::acos:
      return reinterpret_cast<const void*>(Sleef_acosd4_u10avx2);
    case Op::atan:
      return reinterpret_cast<const void*>(Sleef_atand4_u10avx2);
    case Op::sinh:
      return reinterpret_cast<const void*>(Sleef_sinhd4_u10avx2);
    case Op::cosh:
      return reinterpret_cast<const void*>(Sleef_coshd4_u10avx2);
    case Op::tanh:
      return reinterpret_cast<const void*>(Sleef_tanhd4_u10avx2);
    case Op::asinh:
      return reinterpret_cast<const void*>(Sleef_asinhd4_u10avx2);
    case Op::acosh:
      return reinterpret_cast<const void*>(Sleef_acoshd4_u10avx2);
    case Op::atanh:
      return reinterpret_cast<const void*>(Sleef_atanhd4_u10avx2);
    case Op::exp:
      return reinterpret_cast<const void*>(Sleef_expd4_u10avx2);
    case Op::log:
      return reinterpret_cast<const void*>(Sleef_logd4_u10avx2);
    case Op::pow:
      return reinterpret_cast<const void*>(Sleef_powd4_u10avx2);
    case Op::atan2:
      return reinterpret_cast<const void*>(Sleef_atan2d4_u10avx2);
    default:
      return nullptr;
  }
}

}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function(Op) { return nullptr; }
}  // namespace pendula::codegen

#endif
