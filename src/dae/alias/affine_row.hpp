// Residuals split into terms that are linear in unknowns, and the rest.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// The unknowns of a model and their derivatives, numbered: x_j^(k) is j·stride + k. Numbers follow the order
/// of the model's variables, so that nothing depends on the ids of leaves.
class UnknownNumbers {
 public:
  explicit UnknownNumbers(const Model& model);
  int stride() const { return stride_; }
  int size() const { return static_cast<int>(leaves_.size()); }
  /// None for what is no unknown.
  std::optional<int> of(Expr leaf) const;
  Expr leaf(int number) const { return leaves_[number]; }
  int order(int number) const { return number % stride_; }
  int base(int number) const { return number - order(number); }

 private:
  std::unordered_map<Expr, int> numbers_;
  std::vector<Expr> leaves_;
  int stride_ = 2;
};

/// 0 = Σ coefficientₖ unknownₖ + rest. An unknown may be a term and occur in the rest as well.
struct AffineRow {
  struct Term {
    int unknown;
    Expr coefficient;  ///< in parameters, inputs and t
  };
  std::vector<Term> terms;  ///< by unknown
  Expr rest;
  std::vector<int> inside;  ///< unknowns in the rest, ascending

  const Term* find(int unknown) const;
  bool has_inside(int unknown) const;
  /// terms + factor·unknown; a coefficient that becomes 0 disappears.
  void add(int unknown, Expr factor);
  /// this + factor·other.
  void add(const AffineRow& other, Expr factor);
  void put_inside(int unknown);
  void take_inside(int unknown);
};

/// The rows of all residuals of a model. Cost: linear in the size of the expressions.
std::vector<AffineRow> affine_rows(const Model& model, const UnknownNumbers& numbers);
AffineRow affine_row(Expr residual, const UnknownNumbers& numbers);

/// a·b and a/b, without factors of ±1, signs in front, and what cancels cancelled: R (u/R) is u.
Expr scaled(Expr a, Expr b);
Expr divided(Expr a, Expr b);

}  // namespace pendula::dae
