// The lines of a derivation: words, with marks where mathematics stands, so that one line can be set as text
// and as LaTeX, and columns take the names they have when the line is read.
//
// A marked line is an ordinary string. \x1d…\x1e encloses the number of an expression (or of the entries of a
// column or matrix) in the graph, \x1c…\x1f a formula made of such references and of signs; \x1a or \x1b at
// the beginning says that the line belongs to a detailed derivation.
#pragma once

#include <string>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

/// Marks for an expression, a column (one entry stands without parentheses), a matrix.
std::string ref(Expr e);
std::string ref(const VecX& v);
std::string ref(const MatX& m);
/// A formula: formula("0 = ", ref(C)).
template <class... Parts>
std::string formula(const Parts&... parts) {
  return "\x1c" + text("", parts...) + "\x1f";
}

/// A column as a side of an equation: with one entry as a multiple of a unit vector, -m g e₃.
std::string ref_side(const VecX& v);
/// ∂L/∂x, and d/dt ∂L/∂x, for a scalar or a column x.
std::string ref_partial(const std::string& function, const VecX& x);
std::string ref_rate_of_partial(const std::string& function, const VecX& x);

/// How much of a derivation is shown: results, the steps between them, every step with its parts.
enum class Detail { brief, full, every };
/// A line that stands in derivations of at least this detail.
std::string shown_from(Detail least, const std::string& line);
/// Whether a line belongs to a derivation of this detail.
bool is_shown(const std::string& line, Detail detail);

enum class Notation { text, latex };
/// The line with its marks written out.
std::string rendered(const std::string& line, Notation notation = Notation::text);
/// Unicode mathematics in words (C₁′ ≠ 0, α) as LaTeX; `inside`: between dollars already.
std::string latex_words(const std::string& words, bool inside);

/// The lines of this detail as text; as LaTeX, paragraphs with displayed formulas.
std::string written_out(const std::vector<std::string>& lines, Detail detail, Notation notation);

/// The derivation from the original model to this one, oldest step first.
std::string trace(const Model& model, Detail detail = Detail::full, Notation notation = Notation::text);

}  // namespace pendula::dae
