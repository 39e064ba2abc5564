// x = A⁻¹ b as a node of the graph: a linear solve that is never expanded into symbols.
//
// The n components of one solution are n nodes. The first one, the head, owns the entries of A and b as its
// operands and has the value x₁; the other components have the head as their only operand. So every node is
// a scalar, indices stay a topological order, and a pass does the linear algebra once, at the head, and reads
// x₂ … xₙ from what it kept.
//
// Derivatives share the matrix (Giles, Collected matrix derivative results for forward and reverse mode
// algorithmic differentiation, 2008, §2.3.1; docs/derivations.md#solve-node):
//   forward  A dx = db - dA x                  reverse  Aᵀ λ = x̄,  b̄ += λ,  Ā -= λ xᵀ
#pragma once

#include <functional>
#include <map>
#include <set>
#include <vector>

#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula {

/// One system of equations: what all components of its solution have in common. The matrix is sparse.
struct LinearSystem {
  int size = 0;
  std::vector<std::pair<int, int>> places;  ///< row and column of the entries of A, by rows
  std::vector<Expr> operands;               ///< the entries of A in this order, then b
  std::uint32_t matrix = 0;  ///< equal for systems with the same A, or with A and Aᵀ: one factorisation
  bool transposed = false;   ///< A is the transpose of the matrix of that number as it was first seen
  bool definite = false;     ///< A is symmetric and positive or negative definite: needs no pivoting
  int leading = 0;           ///< of saddle_solution(); 0: none

  std::size_t entries() const { return places.size(); }
  Expr b(int i) const { return operands[entries() + static_cast<std::size_t>(i)]; }
};

/// x with A x = b. Unknowns that stand alone in a row, or in one row only, are divided out; b = 0 gives 0,
/// rational numbers the exact result; the rest becomes solve nodes.
///
/// shapes    A ∈ ℝⁿˣⁿ, b ∈ ℝⁿ
/// throws    Error if A has a row or column of zeros, or is rational and singular
VecX linear_solution(const MatX& A, const VecX& b);

/// The same with the nonzero entries of A. `definite`: the caller knows that A is symmetric, and definite
/// wherever it is regular; it is then factored without pivoting, in an order that keeps it sparse.
VecX linear_solution(const std::vector<Entry>& A, const VecX& b, bool definite = false);

/// The same for A = [M Cᵀ; C D], symmetric, with M ∈ ℝˡˣˡ, l = leading, positive definite and D negative
/// semidefinite at most points: M first, then D - C M⁻¹ Cᵀ, needs no pivots there and keeps both sparse.
/// Programs that do so check it at every evaluation (codegen/program/checked.hpp).
VecX saddle_solution(const std::vector<Entry>& A, const VecX& b, int leading);

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

// ── numbers ────────────────────────────────────────────────────────────────────────────────────────────────
// The same elimination on doubles, or over any field.

/// P A = L U in place with partial pivoting, rows of A one after the other; pivot[k] is the row exchanged
/// with row k, and the diagonal holds 1/uₖₖ. A singular matrix leaves solutions that are not finite.
void lu_factor(double* a, double* pivot, int n);
/// b becomes A⁻¹ b, or A⁻ᵀ b. Requires the result of lu_factor.
void lu_solve(const double* lu, const double* pivot, double* b, int n, bool transposed);

/// The solution over any field: `strength` of a number says how good a pivot it is, 0: it is zero.
/// numbers: in the order of LinearSystem::operands. Returns an empty list where the matrix is
/// singular. Cost: that of the fill.
template <class T, class Strength>
std::vector<T> eliminate(const LinearSystem& system, const std::vector<T>& numbers,
                         const Strength& strength) {
  const int n = system.size;
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  std::vector<std::map<int, T>> rows(at(n));
  std::vector<std::set<int>> users(at(n));  // rows of a column, those that have been pivots excepted
  std::vector<T> b(numbers.end() - n, numbers.end());
  for (std::size_t k = 0; k < system.entries(); ++k) {
    const auto [i, j] = system.places[k];
    if (strength(numbers[k]) == 0) continue;
    rows[at(i)].emplace(j, numbers[k]);
    users[at(j)].insert(i);
  }
  std::vector<int> pivots;
  for (int k = 0; k < n; ++k) {
    int best = -1;
    for (int i : users[at(k)])
      if (best < 0 || strength(rows[at(i)].at(k)) > strength(rows[at(best)].at(k))) best = i;
    if (best < 0) return {};
    pivots.push_back(best);
    const std::map<int, T>& pivot = rows[at(best)];
    for (const auto& [j, value] : pivot) users[at(j)].erase(best);
    for (int i : users[at(k)]) {
      std::map<int, T>& row = rows[at(i)];
      const T factor = row.at(k) / pivot.at(k);
      row.erase(k);
      for (const auto& [j, value] : pivot) {
        if (j <= k) continue;
        const auto old = row.find(j);
        const T now = (old == row.end() ? T{} : old->second) - factor * value;
        if (strength(now) == 0) {
          if (old != row.end()) {
            row.erase(old);
            users[at(j)].erase(i);
          }
        } else if (old != row.end()) {
          old->second = now;
        } else {
          row.emplace(j, now);
          users[at(j)].insert(i);
        }
      }
      b[at(i)] = b[at(i)] - factor * b[at(best)];
    }
  }
  std::vector<T> x(b);
  for (int k = n - 1; k >= 0; --k) {
    T value = b[at(pivots[at(k)])];
    for (const auto& [j, entry] : rows[at(pivots[at(k)])])
      if (j > k) value = value - entry * x[at(j)];
    x[at(k)] = value / rows[at(pivots[at(k)])].at(k);
  }
  return x;
}

}  // namespace pendula
