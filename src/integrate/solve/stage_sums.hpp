// Linear combinations of the stages of an explicit step, of which a tableau uses only some.
#pragma once

#include <vector>

namespace pendula::integrate {

struct StageTerm {
  int stage;
  double factor;
};
/// A row of a tableau without its zeros.
using StageRow = std::vector<StageTerm>;

/// out[k] = x[k] + h Σ factor · K[stage · n + k] for 0 ≤ k < n; out may be x. Bitwise the same on every
/// processor.
void add_stages(int n, const double* x, double h, const StageRow& row, const double* K, double* out);

}  // namespace pendula::integrate
