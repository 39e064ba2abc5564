// Functions that machine code calls: one per operation of ops.def that is not a machine instruction, and the
// steps of linear systems.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula::codegen {

/// double f(double a, double b, double c): the value column of ops.def; sin and cos of routines/sines.hpp.
const void* scalar_function(Op op);
/// __m256d f(__m256d a, __m256d b) for 4 lanes, __m512d for 8: SLEEF's, at most 1 ulp off, and those whose
/// bits depend on nothing but the operands of a lane ("finz"). Null where the build has none.
const void* lane_function4(Op op);
const void* lane_function8(Op op);
inline const void* lane_function(Op op, int lanes) {
  return lanes == 8 ? lane_function8(op) : lane_function4(op);
}

/// ln and exp of one number with the bits that lanes get, for results that must be equal with and without
/// lanes; those of the C library where the processor or the build has no lanes.
double lane_log(double a);
double lane_exp(double a);

/// void f(double* matrix, int n): n² numbers become LU, followed by n pivots; every number `lanes` times.
const void* factor_function(int lanes);
/// void f(double* right_side, int n, const double* factors, int transposed).
const void* solve_function(int lanes);
/// void f(double* matrix, int n, int band) and void f(double* right_side, int n, const double* factors, int
/// band): those of band.hpp, every number `lanes` times.
const void* band_factor_function(int lanes);
const void* band_solve_function(int lanes);

/// For one number: double → (sin, cos) in the first two vector registers. The values are those of
/// scalar_function(Op::sin) and scalar_function(Op::cos), and of wide_sincos_function().
const void* sincos_function();

}  // namespace pendula::codegen
