#include "codegen/functions.hpp"

#include <cmath>
#include <vector>

#include "expr/solve.hpp"

namespace pendula::codegen {
namespace {

#define OP(name, arity, style, value, da, db, dc, lo, hi, latex, help)                                   \
  double name##_value([[maybe_unused]] double a, [[maybe_unused]] double b, [[maybe_unused]] double c) { \
    return static_cast<double>(value);                                                                   \
  }
#include "expr/ops.def"
#undef OP

void factor(double* matrix, int n) { lu_factor(matrix, matrix + n * n, n); }
void solve(double* b, int n, const double* factors, int transposed) {
  lu_solve(factors, factors + n * n, b, n, transposed != 0);
}

constexpr int lanes = 4;

void gather(const double* from, int count, int lane, std::vector<double>& to) {
  to.resize(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) to[static_cast<std::size_t>(k)] = from[lanes * k + lane];
}
void scatter(const std::vector<double>& from, int lane, double* to) {
  for (std::size_t k = 0; k < from.size(); ++k) to[lanes * k + static_cast<std::size_t>(lane)] = from[k];
}

void factor_lanes(double* matrix, int n) {
  static thread_local std::vector<double> a;
  for (int lane = 0; lane < lanes; ++lane) {
    gather(matrix, n * n + n, lane, a);
    factor(a.data(), n);
    scatter(a, lane, matrix);
  }
}
void solve_lanes(double* b, int n, const double* factors, int transposed) {
  static thread_local std::vector<double> a, x;
  for (int lane = 0; lane < lanes; ++lane) {
    gather(factors, n * n + n, lane, a);
    gather(b, n, lane, x);
    solve(x.data(), n, a.data(), transposed);
    scatter(x, lane, b);
  }
}

template <class F>
const void* address(F* function) {
  return reinterpret_cast<const void*>(function);
}

}  // namespace

const void* scalar_function(Op op) {
  switch (op) {
#define OP(name, arity, style, value, da, db, dc, lo, hi, latex, help) \
  case Op::name:                                                       \
    return address(name##_value);
#include "expr/ops.def"
#undef OP
    default:
      return nullptr;
  }
}

const void* factor_function(int count) { return count == 1 ? address(factor) : address(factor_lanes); }
const void* solve_function(int count) { return count == 1 ? address(solve) : address(solve_lanes); }

}  // namespace pendula::codegen
