#include "codegen/routines/band.hpp"

#include <algorithm>
#include <cstddef>

namespace pendula::codegen {
namespace {

/// The row at which both elimination fronts meet.
int middle(int n) { return n / 2; }

/// Moves both fronts to row m. up() increases i, down() decreases j; in turns, since neither waits for the
/// other's division.
template <class Up, class Down>
void meet(const int& i, const int& j, int m, const Up& up, const Down& down) {
  while (i < m && j > m) {
    up();
    down();
  }
  while (i < m) up();
  while (j > m) down();
}

// One diagonal, eliminated from both ends: above the middle l[i] = A(i, i-1)/d[i-1] belongs to row i, below
// it l[i] = A(i, i-1)/d[i] belongs to row i-1. Overwrites a by 1/d and l.
void factor_from_both_ends(double* a, int n) {
  double* const d = a;
  double* const l = a + n;
  const int m = middle(n);
  // reciprocals of the previous pivots
  double up = m > 0 ? 1 / d[0] : 0, down = m < n - 1 ? 1 / d[n - 1] : 0;
  int i = 1, j = n - 2;
  const auto step_up = [&] {
    const double e = l[i];
    d[i - 1] = up;
    l[i] = e * up;
    up = 1 / (d[i] - e * e * up);
    ++i;
  };
  const auto step_down = [&] {
    const double e = l[j + 1];
    d[j + 1] = down;
    l[j + 1] = e * down;
    down = 1 / (d[j] - e * e * down);
    --j;
  };
  meet(i, j, m, step_up, step_down);
  double pivot = d[m];
  if (m > 0) {
    const double e = l[m];
    d[m - 1] = up;
    l[m] = e * up;
    pivot -= e * e * up;
  }
  if (m < n - 1) {
    const double e = l[m + 1];
    d[m + 1] = down;
    l[m + 1] = e * down;
    pivot -= e * e * down;
  }
  d[m] = 1 / pivot;
}

void solve_from_both_ends(double* b, int n, const double* factors) {
  const double *const r = factors, *const l = factors + n;
  const int m = middle(n);
  double up = b[0], down = b[n - 1];
  int i = 1, j = n - 2;
  const auto step_up = [&] {
    b[i] = up = b[i] - l[i] * up;
    ++i;
  };
  const auto step_down = [&] {
    b[j] = down = b[j] - l[j + 1] * down;
    --j;
  };
  meet(i, j, m, step_up, step_down);
  double x = b[m];
  if (m > 0) x -= l[m] * up;
  if (m < n - 1) x -= l[m + 1] * down;
  up = down = b[m] = x * r[m];
  i = m - 1;
  j = m + 1;
  const auto back_up = [&] {
    b[i] = up = b[i] * r[i] - l[i + 1] * up;
    --i;
  };
  const auto back_down = [&] {
    b[j] = down = b[j] * r[j] - l[j] * down;
    ++j;
  };
  while (i >= 0 && j < n) {
    back_up();
    back_down();
  }
  while (i >= 0) back_up();
  while (j < n) back_down();
}

}  // namespace

// Several diagonals, eliminated from the top: 1/d, and L(i, i - k) at [k·n + i].
void band_factor(double* a, int n, int band) {
  if (band == 1) return factor_from_both_ends(a, n);
  const auto at = [&](int i, int k) -> double& { return a[static_cast<std::ptrdiff_t>(k) * n + i]; };
  for (int i = 0; i < n; ++i) {
    const int first = std::min(i, band);
    for (int k = first; k >= 1; --k) {  // L(i, j) D(j), j = i - k
      double sum = at(i, k);
      for (int l = k + 1; l <= first && l - k <= band; ++l) sum -= at(i, l) * at(i - k, l - k);
      at(i, k) = sum;
    }
    double pivot = at(i, 0);
    for (int k = first; k >= 1; --k) {
      const double scaled = at(i, k) * at(i - k, 0);
      pivot -= scaled * at(i, k);
      at(i, k) = scaled;
    }
    at(i, 0) = 1 / pivot;
  }
}

void band_solve(double* b, int n, const double* factors, int band) {
  if (band == 1) return solve_from_both_ends(b, n, factors);
  const auto at = [&](int i, int k) { return factors[static_cast<std::ptrdiff_t>(k) * n + i]; };
  for (int i = 0; i < n; ++i)
    for (int k = std::min(i, band); k >= 1; --k) b[i] -= at(i, k) * b[i - k];
  for (int i = n - 1; i >= 0; --i) {
    b[i] *= at(i, 0);
    for (int k = 1; k <= band && i + k < n; ++k) b[i] -= at(i + k, k) * b[i + k];
  }
}

}  // namespace pendula::codegen
