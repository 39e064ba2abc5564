// Blocks of the system Jacobian whose determinant is too large to be written out. They must keep their rank
// along a solution: the monitor of ranks gets them as matrices (integrate/event/monitor/rank_monitor.hpp).
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// A block of more than four equations of the system Jacobian J of the model that a form was made from.
struct LargeBlock {
  struct Matrix {
    int rows = 0, columns = 0;
    std::vector<Entry> entries;  ///< by rows, each position once, in unknowns of the form
  };
  /// The rows of J that are differentiated (for mechanisms ∂C/∂q), after elimination of rows that only say
  /// q′ = v. They must be independent. No rows: none, or all of them constant.
  Matrix gradients;
  std::vector<std::string> constraints;  ///< names of the rows: "C₁", "(3)"
  std::vector<Expr> moved;               ///< of every column of the gradients, what it determines
  std::vector<Expr>
      inertia;  ///< of every column of the gradients, its diagonal entry of M; empty: M is not known
  /// J itself, which must be regular; no rows where that follows from the gradients
  /// (`definite`) or J is constant.
  Matrix jacobian;
  /// For messages about a lost rank: names of all equations of the block, and what they determine.
  Matrix all;
  std::vector<std::string> equations;
  std::vector<Expr> determined;
};

/// Empty where the analysis is not regular. Where J is [M F; G 0] with the mass matrix of a Lagrangian
/// and F = GᵀR, or with a constant diagonal M, F = D Gᵀ R, D⁻¹M positive (accelerations may be divided
/// by their masses), it is singular only where G has dependent rows, and J is not monitored. Cost:
/// linear in the entries of J, cached.
std::vector<LargeBlock> large_blocks(const ModelPtr& model);

}  // namespace pendula::dae
