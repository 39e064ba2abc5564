// Large models repeat their equations for every link or cell: the same expression of other variables. What
// was rewritten once is rewritten again by renaming.
#pragma once

#include <optional>
#include <vector>

#include "base/lru_cache.hpp"
#include "expr/graph/graph.hpp"

namespace pendula {

/// An expression up to the names of its variables. Equal keys: the same operations on the same constants and
/// parameters, of variables that are declared in the same order with the same derivatives.
struct Pattern {
  std::vector<std::uint32_t> key;
  std::vector<Expr> variables;  ///< of order 0, as the key numbers them
};
/// Nothing for expressions that are small or very large, and those
/// with unspecified functions or linear systems. Cost: linear.
std::optional<Pattern> pattern_of(Expr e);

/// Remembers results by pattern.
class RewrittenPatterns {
 public:
  /// The result for the variables of this pattern.
  std::optional<Expr> find(const Pattern& pattern);
  void add(const Pattern& pattern, Expr result);
  void clear() { known_.clear(); }

 private:
  struct Node {
    Op op;
    Expr leaf;                 ///< of constants, parameters …
    std::uint32_t operand[3];  ///< earlier nodes; of a variable: its number and the order of its derivative
  };
  static constexpr std::size_t most_ = 20'000;  ///< patterns: 100 MB if each has 200 nodes
  LruCache<std::vector<std::uint32_t>, std::vector<Node>, WordsHash, Refers::by_touch> known_{most_};
};

}  // namespace pendula
