// Expressions as a textbook would set them: like terms collected, stable order, x′
// x″, vectors by their names.
//
// The graph knows scalars only. Before printing, an expression is brought to a collected form (sums of
// rational multiples of products of powers), and sums such as q₁p₁ + q₂p₂ + q₃p₃ over all components of known
// columns are recognised and written qᵀp. Known columns are those declared with a size (var("q", 6)) and the
// aliases passed in.
#pragma once

#include <string>
#include <vector>

#include "expr/graph/matrix.hpp"

namespace pendula {

/// A name for a list of leaves: p1 for (q1, q2, q3). Derivatives of all of them print as p1′.
struct VectorName {
  std::string name;
  std::vector<Expr> components;
};

struct PrintOptions {
  bool latex = false;
  std::vector<VectorName> aliases;  ///< preferred over declared columns; longer ones are tried first
};

/// The options used when none are given; the Lua layer sets the aliases it finds in the user's variables.
PrintOptions& default_print_options();

std::string to_text(Expr e);
std::string to_text(Expr e, const PrintOptions& options);
std::string to_latex(Expr e);

/// A column as a vector expression by names ("-m g e₃ - z p"), or "(a, b, c)" where there is none.
std::string vector_to_text(const VecX& v, const PrintOptions& options = default_print_options());
/// A matrix as an aligned grid over several lines (LaTeX: a bmatrix).
std::string matrix_to_text(const MatX& m, const PrintOptions& options = default_print_options());

/// Lua text that rebuilds the same node, also in a new session, in the vocabulary of the language:
///
///   symbols     var("x") input("u") t pi var("q", 6)[3] der(var("x"), 2) param("m", 1), with its default
///   numbers     2  9.81  0.5 where Lua reads them exactly, rational("1/3") otherwise
///   operations  + - * / ^ and the functions by name; conditions lt le all any, as in ifelse(lt(a, b), p, q)
///   functions   func("g")(vec{a, b}, c); a formal derivative is taken at placeholders, for which the
///               arguments are then substituted
///   large       (function() local e = {}; e[1] = …; return … end)(): shared or deep parts appear once
///
///
/// Cost: linear in the nodes of e, in time and in length.
std::string to_code(Expr e);

/// The unit of a leaf as it was declared, of a derivative by time per second: "m/s", "m/s²"; "" without one.
std::string unit_text(Expr leaf);

}  // namespace pendula
