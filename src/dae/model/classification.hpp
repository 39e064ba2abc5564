// What kind of DAE a model is and what its index depends on, in the words of a textbook
// (Brenan, Campbell & Petzold §1.2 and §2.5).
#pragma once

#include <string>
#include <vector>

#include "dae/singular/validity.hpp"

namespace pendula::dae {

/// Where the structural answer holds, one line per kind of condition; empty if everywhere.
std::vector<std::string> condition_lines(const Model& model, const Analysis& analysis,
                                         const Validity& validity);

/// For models with unspecified functions: which rows lack the algebraic variables, what has to be
/// differentiated, on what the index depends. Rows: a keyword and its text.
std::vector<std::pair<std::string, std::string>> classification(const Model& model);

/// "n_x = 2, n_z = 1, n_u = 1; F has m = 3 rows: …", why m = n_x + n_z.
std::string counts(const Model& model);

}  // namespace pendula::dae
