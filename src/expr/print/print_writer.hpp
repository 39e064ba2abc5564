// From forms to pieces: which sign, which fraction, which parentheses. Shared by text and LaTeX.
#pragma once

#include "expr/print/print_notation.hpp"
#include "expr/print/vectors.hpp"

namespace pendula {

class Writer {
 public:
  Writer(NormalForms& forms, const Columns& columns, const Notation& notation)
      : forms_(forms), finder_(forms, columns), notation_(notation) {}

  /// The whole of a form. Beyond some size or depth parts are replaced by their number of operations.
  std::string whole(SumId sum);
  /// A column by names, by blocks of names, or entry by entry.
  std::string whole(const std::vector<SumId>& entries);

 private:
  Piece sum(SumId id);
  Piece items(std::vector<Item> list, std::size_t left_out = 0);
  Piece item(const Item& item);  // without its sign
  Piece lift(const Lift& l);
  Piece factor(AtomId atom, const mpq_class& exponent);
  Piece atom(AtomId id);
  Piece function(const Atom& a);
  Piece call(const Atom& a);
  Piece argument(const std::vector<SumId>& group);
  Piece column(const std::vector<SumId>& entries, bool blocks);
  std::optional<Piece> plain_symbol(SumId id);
  std::optional<Piece> in_blocks(const std::vector<SumId>& entries);
  std::optional<Piece> norm(SumId argument);
  void decide(const Traits& traits);
  std::size_t operations(const Atom& a) const;

  NormalForms& forms_;
  VectorFinder finder_;
  const Notation& notation_;
  bool eliding_ = false;
  int nesting_ = 0;
  std::size_t written_ = 0;
};

}  // namespace pendula
