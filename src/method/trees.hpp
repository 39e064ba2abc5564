// Rooted trees, by increasing order: what the order conditions of Runge-Kutta methods are numbered with.
// Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.2.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace pendula::integrate {

struct RootedTree {
  int order = 1;              ///< number of vertices |τ|
  long gamma = 1;             ///< γ(τ) = |τ| ∏ γ(children): Σ bᵢφᵢ(τ) = 1/γ(τ)
  long symmetry = 1;          ///< σ(τ), the order of its symmetry group
  std::vector<int> children;  ///< numbers of the subtrees below the root, largest first
};

/// All trees of order 1 … `order`, in a fixed order; number 0 is the single vertex. Made on first use and
/// kept: 1, 2, 4, 8, 17, 37, 85, 200, 486, 1205, 3047, 7813 trees up to order 1 … 12.
std::span<const RootedTree> rooted_trees(int order);

/// The trees of exactly this order: numbers first … last - 1.
struct TreeRange {
  int first, last;
};
TreeRange trees_of_order(int order);

/// "τ", "[τ]", "[τ²[τ]]": the root in brackets around its subtrees.
std::string tree_name(int tree);

/// The elementary weight as a formula in A, b, c: "bᵀ(c·Ac²)", products by components.
std::string elementary_weight(int tree);

}  // namespace pendula::integrate
