#include "method/trees.hpp"

#include <algorithm>

#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

/// The trees so far; those of order n are first[n - 1] … first[n] - 1.
struct Forest {
  std::vector<RootedTree> trees;
  std::vector<int> first = {0};

  int orders() const { return static_cast<int>(first.size()) - 1; }

  /// Appends the trees of the next order: multisets of smaller trees with order - 1 vertices in all.
  void grow() {
    RootedTree root;
    root.order = orders() + 1;
    root.gamma = root.order;
    hang(root, root.order - 1, static_cast<int>(trees.size()), 0);
    first.push_back(static_cast<int>(trees.size()));
  }

  /// Attaches subtrees with `vertices` vertices in total to the root, each with a number below `bound`;
  /// `repeated` counts those of the last kind.
  void hang(const RootedTree& root, int vertices, int bound, int repeated) {
    if (vertices == 0) {
      poll_interrupt();
      trees.push_back(root);
      return;
    }
    for (int child = std::min(bound, first[vertices]); child-- > 0;) {
      const RootedTree& subtree = trees[child];
      const int times = !root.children.empty() && root.children.back() == child ? repeated + 1 : 1;
      RootedTree next = root;
      next.children.push_back(child);
      next.gamma *= subtree.gamma;
      next.symmetry *= subtree.symmetry * times;
      hang(next, vertices - subtree.order, child + 1, times);
    }
  }
};

Forest& forest(int order) {
  static Forest trees;
  while (trees.orders() < order) trees.grow();
  return trees;
}

std::string power(const std::string& base, int exponent) {
  return exponent == 1 ? base : base + superscript(exponent);
}

const RootedTree& tree_at(int tree) {
  int order = 1;
  while (forest(order).first.back() <= tree) ++order;
  return forest(order).trees[tree];
}

/// Calls visit(child, times) for every distinct child, smallest first.
template <class Visit>
void each_kind(const RootedTree& tree, const Visit& visit) {
  for (auto at = tree.children.rbegin(); at != tree.children.rend();) {
    const auto next = std::find_if(at, tree.children.rend(), [&](int child) { return child != *at; });
    visit(*at, static_cast<int>(next - at));
    at = next;
  }
}

/// φ(τ) as a product by components; `factors` counts them.
std::string stage_formula(const RootedTree& tree, int& factors) {
  std::string product;
  factors = 0;
  each_kind(tree, [&](int child, int times) {
    std::string factor;
    if (child == 0) {
      factor = power("c", times);
    } else {
      int inner = 0;
      const std::string below = stage_formula(tree_at(child), inner);
      factor = inner > 1 ? "A(" + below + ")" : "A" + below;
      if (times > 1) factor = power("(" + factor + ")", times);
    }
    product += (factors++ ? "·" : "") + factor;
  });
  return product;
}

}  // namespace

std::span<const RootedTree> rooted_trees(int order) {
  const Forest& trees = forest(order);
  return {trees.trees.data(), static_cast<std::size_t>(trees.first[order])};
}

TreeRange trees_of_order(int order) {
  const Forest& trees = forest(order);
  return {trees.first[order - 1], trees.first[order]};
}

std::string tree_name(int tree) {
  if (tree == 0) return "τ";
  std::string name;
  each_kind(tree_at(tree), [&](int child, int times) { name += power(tree_name(child), times); });
  return "[" + name + "]";
}

std::string elementary_weight(int tree) {
  if (tree == 0) return "bᵀ1";
  int factors = 0;
  const std::string stages = stage_formula(tree_at(tree), factors);
  return factors > 1 ? "bᵀ(" + stages + ")" : "bᵀ" + stages;
}

}  // namespace pendula::integrate
