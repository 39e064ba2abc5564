#include "codegen/machine/functions.hpp"

#include <cmath>
#include <vector>

#include "codegen/routines/band.hpp"
#include "codegen/routines/sines.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::codegen {
namespace {

#define OP(name, arity, style, parity, exact, code, value, ...)                                          \
  double name##_value([[maybe_unused]] double a, [[maybe_unused]] double b, [[maybe_unused]] double c) { \
    return static_cast<double>(value);                                                                   \
  }
#include "expr/ops.def"
#undef OP

void factor(double* matrix, int n) { lu_factor(matrix, matrix + n * n, n); }
void solve(double* b, int n, const double* factors, int transposed) {
  lu_solve(factors, factors + n * n, b, n, transposed != 0);
}

template <int lanes>
void gather(const double* from, int count, int lane, std::vector<double>& to) {
  to.resize(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) to[k] = from[lanes * k + lane];
}
template <int lanes>
void scatter(const std::vector<double>& from, int lane, double* to) {
  for (std::size_t k = 0; k < from.size(); ++k) to[lanes * k + static_cast<std::size_t>(lane)] = from[k];
}

template <int lanes>
void factor_lanes(double* matrix, int n) {
  static thread_local std::vector<double> a;
  for (int lane = 0; lane < lanes; ++lane) {
    gather<lanes>(matrix, n * n + n, lane, a);
    factor(a.data(), n);
    scatter<lanes>(a, lane, matrix);
  }
}
template <int lanes>
void solve_lanes(double* b, int n, const double* factors, int transposed) {
  static thread_local std::vector<double> a, x;
  for (int lane = 0; lane < lanes; ++lane) {
    gather<lanes>(factors, n * n + n, lane, a);
    gather<lanes>(b, n, lane, x);
    solve(x.data(), n, a.data(), transposed);
    scatter<lanes>(x, lane, b);
  }
}

template <int lanes>
void band_factor_lanes(double* matrix, int n, int band) {
  static thread_local std::vector<double> a;
  for (int lane = 0; lane < lanes; ++lane) {
    gather<lanes>(matrix, n * (band + 1), lane, a);
    band_factor(a.data(), n, band);
    scatter<lanes>(a, lane, matrix);
  }
}
template <int lanes>
void band_solve_lanes(double* b, int n, const double* factors, int band) {
  static thread_local std::vector<double> a, x;
  for (int lane = 0; lane < lanes; ++lane) {
    gather<lanes>(factors, n * (band + 1), lane, a);
    gather<lanes>(b, n, lane, x);
    band_solve(x.data(), n, a.data(), band);
    scatter<lanes>(x, lane, b);
  }
}

double sine(double a, double, double) { return codegen::sincos_value(a).sin; }
double cosine(double a, double, double) { return codegen::sincos_value(a).cos; }

template <class F>
const void* address(F* function) {
  return reinterpret_cast<const void*>(function);
}

}  // namespace

const void* scalar_function(Op op) {
  if (op == Op::sin) return address(sine);
  if (op == Op::cos) return address(cosine);
  switch (op) {
#define OP(name, ...) \
  case Op::name:      \
    return address(name##_value);
#include "expr/ops.def"
#undef OP
    default:
      return nullptr;
  }
}

const void* factor_function(int lanes) {
  return lanes == 1 ? address(factor) : lanes == 4 ? address(factor_lanes<4>) : address(factor_lanes<8>);
}
const void* solve_function(int lanes) {
  return lanes == 1 ? address(solve) : lanes == 4 ? address(solve_lanes<4>) : address(solve_lanes<8>);
}

const void* band_factor_function(int lanes) {
  return lanes == 1   ? address(band_factor)
         : lanes == 4 ? address(band_factor_lanes<4>)
                      : address(band_factor_lanes<8>);
}
const void* band_solve_function(int lanes) {
  return lanes == 1   ? address(band_solve)
         : lanes == 4 ? address(band_solve_lanes<4>)
                      : address(band_solve_lanes<8>);
}

const void* sincos_function() { return address(sincos_value); }

}  // namespace pendula::codegen
