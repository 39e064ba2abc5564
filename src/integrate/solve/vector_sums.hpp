// Sums of vectors over long columns of numbers, four neighbours at a time: compilers leave loops with several
// sums scalar. The results do not depend on the processor.
#pragma once

#include <cstddef>
#include <span>

namespace pendula::integrate {

/// out[k] = base[k] + Σ weight[j] · from[j · stride + k] for 0 ≤ k < n; base may be
/// null (zero). out may be base.
void combine(int n, const double* base, std::span<const double> weights, const double* from,
             std::ptrdiff_t stride, double* out);

/// to[k] += change[k]; adds the squares of change[k] · inverse_scale[k] to sum and takes them into largest.
/// NaN anywhere makes sum NaN.
void apply(int n, double* to, const double* change, const double* inverse_scale, double& sum,
           double& largest);

}  // namespace pendula::integrate
