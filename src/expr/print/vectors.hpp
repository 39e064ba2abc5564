// Vectors by their names: which terms of a sum are one scalar
// product, which entries of a column one named vector.
//
// A lift is what a component factor stands for: q₂ is the second component of q, (q₅ - q₂) that of p2 - p1. A
// set of n terms  c·r·aⱼ·bⱼ, j = 1 … n, with equal c and r is the scalar product c·r·aᵀb. Every copy is
// looked up among the terms before it is claimed, so recognition cannot change the meaning.
#pragma once

#include "expr/normal/normal.hpp"
#include "expr/print/print.hpp"

namespace pendula {

/// Component `index` (1-based) of the column of that name, differentiated `order` times.
struct Component {
  std::string name;
  int size = 0, index = 0, order = 0;
  std::vector<Expr> base;  ///< the components of order 0, or of the alias as it was given
};

class Columns {
 public:
  explicit Columns(const PrintOptions& options);
  /// The columns that the leaf is a component of, in order of preference; at most one of every size.
  std::vector<Component> of(Expr leaf) const;

 private:
  struct Place {
    std::size_t alias;
    int index, order;
  };
  std::vector<VectorName> aliases_;                      // longer first
  std::unordered_map<Expr, std::vector<Place>> places_;  // by base leaf
};

/// A linear combination of columns: Σ scalar · column.
struct LiftedTerm {
  Term scalar;
  Component column;
};
using Lift = std::vector<LiftedTerm>;

/// One term as it is displayed: term, term · aᵀb, term · a, or term · eᵢ.
struct Item {
  Term term;
  Term whole;                  ///< a representative scalar term, for the order
  std::vector<Lift> vectors;   ///< none, one (a) or two (aᵀb)
  int unit = 0;                ///< i of eᵢ
  std::vector<SumId> written;  ///< a column written out entry by entry
};

class VectorFinder {
 public:
  VectorFinder(NormalForms& forms, const Columns& columns) : forms_(forms), columns_(columns) {}

  /// The terms of a sum in textbook order, scalar products collected.
  std::vector<Item> items(SumId sum);
  /// A column by names, or nothing where no named column
  /// occurs in it. Constant entries become multiples of eᵢ.
  std::optional<std::vector<Item>> items(const std::vector<SumId>& entries);

 private:
  struct Carrier {
    std::size_t factor;  // position in the term
    int size, index;
    Lift lift;
  };
  std::vector<Carrier> carriers(const Term& term);
  std::optional<Lift> lift(AtomId atom, int size, int index);
  std::optional<AtomId> component(const Lift& lift, int j);

  NormalForms& forms_;
  const Columns& columns_;
  std::unordered_map<AtomId, std::vector<Component>> known_;
  const std::vector<Component>& components_of(AtomId leaf);
};

}  // namespace pendula
