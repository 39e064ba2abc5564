// Class of a DAE and the conditions of its index, in the words of a textbook
// (Brenan, Campbell & Petzold §1.2 and §2.5).
#pragma once

#include <string>
#include <vector>

#include "dae/analysis/determinant_factors.hpp"

namespace pendula::dae {

/// Where the structural answer holds, one line per kind of condition; empty if everywhere.
std::vector<std::string> condition_lines(const Model& model, const Analysis& analysis,
                                         const DeterminantFactors& validity);

/// For models with unspecified functions: which rows lack the algebraic variables, what has to be
/// differentiated, on what the index depends. Rows: a keyword and its text.
std::vector<std::pair<std::string, std::string>> classification(const Model& model);

}  // namespace pendula::dae
