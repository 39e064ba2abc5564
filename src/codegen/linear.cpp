// Linear systems on the tape: dense LU with partial pivoting on slots. All right sides with the same matrix,
// or with its transpose, share one factorisation.
#include "codegen/kernel.hpp"
#include "expr/solve.hpp"

namespace pendula::codegen {

void Kernel::run_linear(const LinearStep& step, std::uint32_t result, double* w) const {
  const std::uint32_t* const operands = operands_.data() + step.first_operand;
  const int n = step.n, count = step.factor ? n * n : n;
  double* const r = w + result;
  for (int i = 0; i < count; ++i) r[i] = w[operands[i]];
  const double* const factors = w + step.factors;
  if (step.factor)
    lu_factor(r, r + n * n, n);
  else
    lu_solve(factors, factors + n * n, r, n, step.transposed);
}

}  // namespace pendula::codegen
