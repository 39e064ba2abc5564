// Norms of a step of many unknowns, four of them at a time: compilers leave loops with sums scalar, and one
// sum waits for each addition. The results do not depend on the processor.
#pragma once

namespace pendula::integrate {

/// Squares of the entries of a vector, in tolerances.
struct Squares {
  double sum = 0, largest = 0;
};
struct ErrorSizes {
  Squares first, second;
};
/// Of two error estimates e and other in units of atol + rtol max(|before|, |after|), whose reciprocals are
/// kept; scaled[k] becomes e[k] in these units.
ErrorSizes error_sizes(int n, const double* before, const double* after, const double* atol,
                       const double* rtol, const double* e, const double* other, double* inverse_weight,
                       double* scaled);

/// Σ ((a[k] - b[k]) w[k])² and Σ (a[k] w[k])², w[k] = 1 / (atol[k] + rtol[k] |at[k]|).
struct ChangeSizes {
  double change = 0, size = 0;
};
ChangeSizes change_sizes(int n, const double* a, const double* b, const double* at, const double* atol,
                         const double* rtol);

/// The largest |v[k]| / (atol[k] + rtol[k] |at[k]|).
double largest_share(int n, const double* v, const double* at, const double* atol, const double* rtol);

/// Are all of them finite?
bool all_finite(int n, const double* x);

}  // namespace pendula::integrate
