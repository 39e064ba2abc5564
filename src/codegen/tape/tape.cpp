// The interpreter of the grouped tape.
#include "codegen/tape/tape.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "codegen/routines/band.hpp"
#include "codegen/routines/sines.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::codegen {

double Tape::regular_share() const {
  return static_cast<double>(regular_) / static_cast<double>(std::max<std::size_t>(operations(), 1));
}

std::size_t Tape::operations() const {
  std::size_t n = regular_;
  for (const Run& run : runs_) n += run.count;
  return n;
}

// Dense LU with partial pivoting on slots. All right sides with the same matrix or its transpose
// share one factorisation.
void Tape::run_linear(const LinearStep& step, Slot result, const double* in, double* w) const {
  const int n = step.n;
  double* const r = w + result;
  for (Slot k = 0; k < step.copies; ++k) {
    const Copy& c = linear_copies_[step.first_copy + k];
    run_copy(c, c.from < input_count_ ? in : w, r);
  }
  const double* const factors = w + step.factors;
  if (step.factor)
    step.band > 0 ? band_factor(r, n, step.band) : lu_factor(r, r + n * n, n);
  else
    step.band > 0 ? band_solve(r, n, factors, step.band)
                  : lu_solve(factors, factors + n * n, r, n, step.transposed);
}

void Tape::run(const double* in, double* out, double* w) const {
  const auto inputs = static_cast<Slot>(input_count_);
  const auto address = reinterpret_cast<std::uintptr_t>(w) / sizeof(double);
  w += (line - address % line) % line;
  for (const auto& [first, end] : used_inputs_) std::copy(in + first, in + end, w + first);
  std::copy(constants_.begin(), constants_.end(), w + input_count_ + gap);
  for (const Run& run : runs_) {
    for (Slot k = 0; k < run.loops; ++k) run_loop(loops_[run.first_loop + k], inputs, in, w);
    const Slot* const o = operands_.data() + run.first_operand;
    double* const r = w + run.first_slot;
    const std::size_t n = run.count;
    if (run.op == Op::sin || run.op == Op::cos) {
      sines(run.op == Op::sin ? Sine::sin : Sine::cos, w, o, n, r);
      continue;
    }
    switch (run.op) {
#define OP(name, arity, style, parity, exact, code, value, ...)          \
  case Op::name:                                                         \
    for (std::size_t k = 0; k < n; ++k) {                                \
      [[maybe_unused]] const double a = w[o[k]];                         \
      [[maybe_unused]] const double b = arity > 1 ? w[o[n + k]] : 0;     \
      [[maybe_unused]] const double c = arity > 2 ? w[o[2 * n + k]] : 0; \
      r[k] = static_cast<double>(value);                                 \
    }                                                                    \
    break;
#include "expr/ops.def"
#undef OP
      case Op::solve:
        run_linear(linear_[run.first_operand], run.first_slot, in, w);
        break;
      default:
        internal_error(__FILE__, __LINE__, "not an operation on the tape");
    }
  }
  const Slot done = runs_.empty() ? 0 : runs_.back().first_loop + runs_.back().loops;
  for (std::size_t k = done; k < loops_.size(); ++k) run_loop(loops_[k], inputs, in, w);
  for (const Copy& c : copies_) run_copy(c, c.from < input_count_ ? in : w, out);
}

}  // namespace pendula::codegen
