// What machine code calls: one function per operation of ops.def that is not a machine instruction, and the
// steps of linear systems.
#pragma once

#include "expr/graph.hpp"

namespace pendula::codegen {

/// double f(double a, double b): the value column of ops.def.
const void* scalar_function(Op op);
/// __m256d f(__m256d a, __m256d b): SLEEF's, at most 1 ulp off. Null where the build has none.
const void* lane_function(Op op);

/// void f(double* matrix, int n): n² numbers become LU, followed by n pivots; every number `lanes` times.
const void* factor_function(int lanes);
/// void f(double* right_side, int n, const double* factors, int transposed).
const void* solve_function(int lanes);

}  // namespace pendula::codegen
