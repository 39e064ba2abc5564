// x = A⁻¹ b as a node of the graph: a linear solve that is never expanded into symbols.
//
// The n components of one solution are n nodes. The first one, the head, owns the entries of A and b as its
// operands and has the value x₁; the other components have the head as their only operand. So every node is
// a scalar, indices stay a topological order, and a pass does the linear algebra once, at the head, and reads
// x₂ … xₙ from what it kept.
//
// Derivatives share the matrix (Giles, Collected matrix derivative results for forward and reverse mode
// algorithmic differentiation, 2008, §2.3.1):
//   forward  A dx = db - dA x                  reverse  Aᵀ λ = x̄,  b̄ += λ,  Ā -= λ xᵀ
#pragma once

#include <functional>
#include <vector>

#include "expr/matrix.hpp"

namespace pendula {

/// One system of equations: what all components of its solution have in common.
struct LinearSystem {
  int size = 0;
  std::vector<Expr> operands;  ///< A row by row, then b: size² + size
  std::uint32_t matrix = 0;    ///< equal for systems with the same A, or with A and Aᵀ: one factorisation
  bool transposed = false;     ///< A is the transpose of the matrix of that number as it was first seen

  Expr a(int i, int j) const { return operands[static_cast<std::size_t>(i * size + j)]; }
  Expr b(int i) const { return operands[static_cast<std::size_t>(size * size + i)]; }
};

/// x with A x = b. Unknowns that stand alone in a row, or in one row only, are divided out; b = 0 gives 0,
/// rational numbers the exact result; the rest becomes solve nodes.
///
/// shapes    A ∈ ℝⁿˣⁿ, b ∈ ℝⁿ
/// throws    Error if A has a row or column of zeros, or is rational and singular
VecX linear_solution(const MatX& A, const VecX& b);

/// Requires op() == Op::solve. The reference stays valid.
const LinearSystem& system_of(Expr e);
int component_of(Expr e);  ///< 0 for the head
Expr head_of(Expr e);      ///< e itself for the head
/// Component i of the solution with this head.
Expr component(Expr head, int i);

/// A and b with every operand mapped, solved again; the components themselves where nothing changes.
VecX mapped_solution(Expr head, const std::function<Expr(Expr)>& image);
/// dx with A dx = db - dA x, where d gives the derivative of an operand.
VecX solution_tangent(Expr head, const std::function<Expr(Expr)>& d);
/// Calls add(operand, term) for every contribution of the adjoints x̄ to an operand that is `active`.
void solution_adjoint(Expr head, const VecX& adjoints, const std::function<bool(Expr)>& active,
                      const std::function<void(Expr, Expr)>& add);
/// The numbers x; not finite where A is singular.
std::vector<double> solution_value(Expr head, const std::function<double(Expr)>& value);

// ── numbers
// ──────────────────────────────────────────────────────────────────────────────────────────────────────

/// P A = L U in place with partial pivoting, rows of A one after the other; pivot[k] is the row exchanged
/// with row k. A singular matrix leaves a zero on the diagonal, and solutions that are not finite.
void lu_factor(double* a, double* pivot, int n);
/// b becomes A⁻¹ b, or A⁻ᵀ b. Requires the result of lu_factor.
void lu_solve(const double* lu, const double* pivot, double* b, int n, bool transposed);

/// The solution over any field: `strength` of a number says how good a pivot it is, 0: it is zero.
/// operands as in LinearSystem. Returns an empty list where the matrix is singular.
template <class T, class Strength>
std::vector<T> eliminate(std::vector<T> operands, int n, const Strength& strength) {
  const auto a = [&](int i, int j) -> T& { return operands[static_cast<std::size_t>(i * n + j)]; };
  const auto b = [&](int i) -> T& { return operands[static_cast<std::size_t>(n * n + i)]; };
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i)
      if (strength(a(i, k)) > strength(a(best, k))) best = i;
    if (strength(a(best, k)) == 0) return {};
    for (int j = 0; j < n; ++j) std::swap(a(k, j), a(best, j));
    std::swap(b(k), b(best));
    for (int i = k + 1; i < n; ++i) {
      if (strength(a(i, k)) == 0) continue;
      const T factor = a(i, k) / a(k, k);
      for (int j = k + 1; j < n; ++j) a(i, j) = a(i, j) - factor * a(k, j);
      b(i) = b(i) - factor * b(k);
    }
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int j = i + 1; j < n; ++j) b(i) = b(i) - a(i, j) * b(j);
    b(i) = b(i) / a(i, i);
  }
  return {operands.end() - n, operands.end()};
}

}  // namespace pendula
