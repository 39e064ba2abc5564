// Models with ifelse, abs, min and max: the index in each of their regions.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// A region of a piecewise model, and the equations that hold there.
struct Region {
  std::string where;  ///< "x < 0, z ≥ 0"
  Model model;        ///< residuals without the pieces
  /// Not negative in the region, without the pieces. Of 0 = min(a, b) where a < b: b
  /// itself, in its own units.
  std::vector<Expr> margins;
};

/// The branches of a piecewise model: every ifelse, abs, min and max is one of two expressions.
/// Nodes with one border are one choice. Those under a root, √|y|, are none: √y, which has no
/// slope at y = 0, would end there.
class Choices {
 public:
  explicit Choices(const Model& model);
  std::size_t size() const { return margins_.size(); }
  /// Bit k of `choice`: the second side of choice k.
  Region region(std::uint64_t choice) const;
  /// The sides that are in force at values; leaves without value count as 0.
  std::uint64_t active(const std::unordered_map<Expr, double>& values) const;
  /// The choices that these values decide, borders that contain nothing else and are
  /// not 0 there, and their sides.
  struct Decided {
    std::uint64_t choices = 0, sides = 0;
    bool allow(std::uint64_t choice) const { return (choice & choices) == sides; }
  };
  Decided decided(const std::unordered_map<Expr, double>& values) const;

 private:
  struct Piece {
    Expr node, first, second;
    std::size_t choice;  ///< which decides about it
    bool reversed;       ///< the first side is the choice's second
  };
  void hide_roots();
  std::size_t choice_of(Expr margin, const std::string& first, const std::string& second, bool& reversed);
  std::vector<Expr> with(std::vector<Expr> e, std::uint64_t choice) const;

  Model model_;                       ///< with a symbol in place of each root that is left as it is
  Substitution roots_;                ///< these roots
  std::vector<Piece> pieces_;         ///< operands first
  std::vector<Expr> margins_;         ///< of each choice: positive on its first side
  std::vector<Expr> hidden_margins_;  ///< the same with symbols in place of roots
  std::vector<std::pair<std::string, std::string>> where_;
};

/// √u or u^q, 0 < q < 1: its slope is infinite at u = 0.
bool is_root(Expr e);
/// 0 = min(a, b) or 0 = max(a, b), up to a sign.
bool is_complementarity(Expr residual);

/// 0 for each sign whose argument vanishes where 0 = c for all c: a body held by a stop rests, and its dry
/// friction is that of neither side.
Substitution resting_signs(const std::vector<Expr>& residuals, const std::vector<Expr>& conditions);

/// All combinations of at most three choices; empty if there are none, or more.
std::vector<Region> regions(const Model& model);

}  // namespace pendula::dae
