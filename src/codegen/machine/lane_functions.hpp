// The table of SLEEF's functions, for the files that are compiled for one kind of vectors each: they define
// nothing that other files could share.
#pragma once

#include <cmath>

#include <immintrin.h>
#include <sleef.h>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {
namespace {

/// Lane after lane, for functions whose vector version
/// fails for large operands (asinh and acosh square them).
template <class Vector, double (*function)(double)>
Vector lane_by_lane(Vector a) {
  for (std::size_t l = 0; l < sizeof(Vector) / sizeof(double); ++l) a[l] = function(a[l]);
  return a;
}

/// The case of a row of ops.def, by its column `code`; an operation that SLEEF has not does not compile.
#define PENDULA_LANE_direct(...)
#define PENDULA_LANE_sleef(name, count, isa) \
  case Op::name:                             \
    return reinterpret_cast<const void*>(Sleef_finz_##name##d##count##_u10##isa);
#define PENDULA_LANE_each(name, ...) \
  case Op::name:                     \
    return reinterpret_cast<const void*>(lane_by_lane<Vector, static_cast<double (*)(double)>(std::name)>);

}  // namespace
}  // namespace pendula::codegen
