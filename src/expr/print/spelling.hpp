// Names as they are typed: what a screen shows as θ₁′ is theta1' on a keyboard.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <unordered_map>

#include "expr/graph/graph.hpp"

namespace pendula {

/// The one plain spelling of a name, whichever of its spellings is given: θ₁′, theta1', theta[1].dot and
/// theta_1_dot are all theta1'. Greek letters become their names, subscripts digits,
/// primes and ".dot" quotes.
std::string plain_spelling(const std::string& name);

/// Leaves by other spellings of their names. All are spelled at the first question: a table may have
/// thousands of keys. `known` must outlive it.
class Spellings {
 public:
  explicit Spellings(std::span<const Expr> known) : known_(known) {}

  /// The leaf that is printed so (θ₁′), or the only one with another spelling: q[1] for q₁, theta1 for
  /// theta_1.
  std::optional<Expr> leaf(const std::string& word);

 private:
  void collect();

  std::span<const Expr> known_;
  std::unordered_map<std::string, Expr> printed_;
  std::unordered_map<std::string, std::optional<Expr>> plain_;
};

}  // namespace pendula
