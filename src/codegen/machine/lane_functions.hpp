// The table of SLEEF's functions, for the files that are compiled for one kind of vectors each: they define
// nothing that other files could share.
#pragma once

#include <cmath>

#include <immintrin.h>
#include <sleef.h>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {
namespace {

/// Lane after lane, for functions whose vector version fails for large operands (asinh and acosh square
/// them).
template <class Vector, double (*function)(double)>
Vector lane_by_lane(Vector a) {
  for (std::size_t l = 0; l < sizeof(Vector) / sizeof(double); ++l) a[l] = function(a[l]);
  return a;
}

#define PENDULA_LANE_FUNCTIONS(Vector, count, isa)                            \
  switch (op) {                                                               \
    case Op::asinh:                                                           \
      return reinterpret_cast<const void*>(                                   \
          lane_by_lane<Vector, static_cast<double (*)(double)>(std::asinh)>); \
    case Op::acosh:                                                           \
      return reinterpret_cast<const void*>(                                   \
          lane_by_lane<Vector, static_cast<double (*)(double)>(std::acosh)>); \
      PENDULA_LANE_FUNCTION(sin, count, isa)                                  \
      PENDULA_LANE_FUNCTION(cos, count, isa)                                  \
      PENDULA_LANE_FUNCTION(tan, count, isa)                                  \
      PENDULA_LANE_FUNCTION(asin, count, isa)                                 \
      PENDULA_LANE_FUNCTION(acos, count, isa)                                 \
      PENDULA_LANE_FUNCTION(atan, count, isa)                                 \
      PENDULA_LANE_FUNCTION(sinh, count, isa)                                 \
      PENDULA_LANE_FUNCTION(cosh, count, isa)                                 \
      PENDULA_LANE_FUNCTION(tanh, count, isa)                                 \
      PENDULA_LANE_FUNCTION(atanh, count, isa)                                \
      PENDULA_LANE_FUNCTION(exp, count, isa)                                  \
      PENDULA_LANE_FUNCTION(log, count, isa)                                  \
      PENDULA_LANE_FUNCTION(pow, count, isa)                                  \
      PENDULA_LANE_FUNCTION(atan2, count, isa)                                \
    default:                                                                  \
      return nullptr;                                                         \
  }
#define PENDULA_LANE_FUNCTION(name, count, isa) \
  case Op::name:                                \
    return reinterpret_cast<const void*>(Sleef_finz_##name##d##count##_u10##isa);

}  // namespace
}  // namespace pendula::codegen
