// Equations as lines of a LaTeX page: broken at + and - where they are too wide,
// numbered as the model numbers them.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"
#include "expr/print/latex_width.hpp"

namespace pendula::dae {

/// A sum in LaTeX cut before + and - outside of all braces and parentheses into pieces that fit a line of
/// `widest` characters as they are seen; a sum without such places is one piece.
std::vector<std::string> line_pieces(const std::string& latex, int widest = line_width);

/// "left = right" for a display: as it is, or in aligned where it is cut.
std::string broken_equation(const std::string& equation);

/// The equations of a model as an align environment with their numbers as tags: a
/// fragment that amsmath compiles.
std::string latex(const Model& model);

}  // namespace pendula::dae
