#include "expr/rewrite/assumption.hpp"

#include <unordered_set>

namespace pendula {
namespace {

struct Assumptions {
  std::unordered_set<Expr> positive{pi()};
  std::size_t made = 0;
};
Assumptions& assumptions() {
  static Assumptions all;
  return all;
}

}  // namespace

void assume_positive(Expr leaf, bool positive) {
  auto& [known, made] = assumptions();
  const bool changed = positive ? known.insert(leaf).second : known.erase(leaf) > 0;
  if (changed) ++made;
}

bool is_assumed_positive(Expr leaf) { return assumptions().positive.contains(leaf); }
std::size_t assumptions_made() { return assumptions().made; }

}  // namespace pendula
