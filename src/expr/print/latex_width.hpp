// How wide a formula in LaTeX will be on paper, to break lines and to set wide matrices smaller.
#pragma once

#include <string>

namespace pendula {

constexpr int line_width = 75;  ///< characters of a formula that a line of an A4 page holds

/// Where the brace that is open before `i` is closed.
std::size_t end_of_group(const std::string& latex, std::size_t i);

/// Characters of a formula on paper, roughly: a fraction counts as its wider part.
int visible_width(const std::string& latex);

}  // namespace pendula
