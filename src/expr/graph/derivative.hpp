// Derivatives are expressions: forward sweeps for a direction, reverse ones for gradients. x, x′, x″ are
// leaves of their own; total derivatives follow the chain rule in time. docs/derivations.md#derivatives.
#pragma once

#include <unordered_map>

#include "expr/graph/matrix.hpp"

namespace pendula {

/// ∂e/∂leaf. Requires a leaf. Cost: linear in the nodes of e.
Expr partial(Expr e, Expr leaf);

/// (∂e/∂leaf)ᵢ for every leaf by one reverse sweep (Griewank & Walther, Evaluating Derivatives, 2nd ed.,
/// §3.2). Cost: a small multiple of the nodes of e, whatever the number of leaves.
std::vector<Expr> gradient(Expr e, std::span<const Expr> leaves);

/// ∂fᵢ/∂xⱼ as an m×n matrix.
MatX jacobian(std::span<const Expr> f, std::span<const Expr> x);

struct Entry {
  int row, column;
  Expr value;
};
/// The structurally nonzero ∂fᵢ/∂xⱼ, by rows, columns ascending. Cost: one reverse sweep
/// per row over that row's nodes.
std::vector<Entry> sparse_jacobian(std::span<const Expr> f, std::span<const Expr> x);

/// de/dt = ∂e/∂t + Σ ∂e/∂x^(k) x^(k+1) over all variables and inputs.
Expr total_derivative(Expr e, int order = 1);

using Substitution = std::unordered_map<Expr, Expr>;
/// Replaces nodes (leaves or whole subexpressions) simultaneously and refolds what lies above them.
Expr substitute(Expr e, const Substitution& replacements);
std::vector<Expr> substitute(std::span<const Expr> outputs, const Substitution& replacements);

/// The value of every output where the leaves have the given values; named constants (π) are known.
/// Throws Error naming the first leaf without a value or an unspecified function. May return NaN or inf.
std::vector<double> evaluate(std::span<const Expr> outputs,
                             const std::unordered_map<Expr, double>& leaf_values);

/// The first node (operands first) whose value is not finite although those of its operands are, or nothing.
std::optional<Expr> first_undefined(Expr e, const std::unordered_map<Expr, double>& leaf_values);

}  // namespace pendula
