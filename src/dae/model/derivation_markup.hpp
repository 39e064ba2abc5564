// The lines of a derivation: words, with marks where mathematics stands, so that one line can be set as text
// and as LaTeX, and columns take the names they have when the line is read.
//
// A marked line is an ordinary string. \x1d…\x1e encloses the number of an expression (or of the entries of a
// column or matrix) in the graph, \x1c…\x1f a formula made of such references and of signs.
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

enum class Notation { text, latex };
/// The line with its marks written out.
std::string rendered(const std::string& line, Notation notation = Notation::text);
/// Unicode mathematics in words (C₁′ ≠ 0, α) as LaTeX; `inside`: between dollars already.
std::string latex_words(const std::string& words, bool inside);

/// The derivation from the original model to this one, oldest step first.
std::string trace(const Model& model);
/// The same as LaTeX paragraphs.
std::string trace_latex(const Model& model);

/// The equations of a model as an align environment with their numbers as tags.
std::string latex(const Model& model);

}  // namespace pendula::dae
