// Text fitted to the width of a screen: equations broken at + and =, words wrapped, matrices and wide tables
// shown in part. What goes into a pipe or a file is never fitted.
//
// The folder knows terminals and no Lua values: fit_text.hpp (here), pager.hpp: a screen at a time,
// terminal.hpp: lines of progress.
#pragma once

#include <string>

namespace pendula::lua {

/// The same text in lines of at most `columns` cells, where that is possible. A column of blanks that many
/// lines share is where continuation lines begin; wide matrices lose columns in the middle, marked by ⋯.
std::string fitted(const std::string& text, int columns);

/// The same text in ASCII, for terminals that show nothing else: θ₁′ becomes theta1', x² x^2.
std::string in_ascii(const std::string& text);

}  // namespace pendula::lua
