// Tableaus as text: reading "1/2 | 1/4 1/4-sqrt(3)/6", and drawing.
#pragma once

#include <string>

#include "method/tableau.hpp"

namespace pendula::integrate {

/// An entry: numbers, + - * / ^, parentheses, sqrt(…) or √3, pi and the other functions of one argument:
/// "(3-sqrt(3))/6". Exact. Throws Error saying what was expected and where.
Expr parse_entry(const std::string& entry);

/// The form a textbook draws: one line per stage "c | a a …", then "| b b …" and, if there is an embedded
/// method, a second line "| bhat …". Entries are separated by blanks; rows of explicit methods may stop at
/// the diagonal; lines of dashes and a title as it is printed are ignored. Only A, b, c and bhat are set.
/// Throws Error naming the line.
TableauData parse_tableau(const std::string& drawing);

}  // namespace pendula::integrate
