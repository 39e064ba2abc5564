// Index and free initial values where factors of parameters vanish.
#pragma once

#include <string>
#include <vector>

#include "dae/analysis/determinant_factors.hpp"
#include "dae/index/differentiation_index.hpp"

namespace pendula::dae {

/// A model with more is not analysed for other values of its parameters.
constexpr std::size_t most_unknowns_of_cases = 12;

/// "index 1, 2 free initial values"
std::string answer_text(const IndexResult& t);
Model without_values(const Model& m);

/// "for ε = 0: index 2, 0 free initial values": the answer where one of the deciding factors vanishes, where
/// two do ("for a = 1 and b = 1"), and for all other values if the model has values for which one vanishes.
/// The factors are `conditions`, those of the determinant of the system Jacobian, and for linear models
/// those of the leading coefficient of det(sE - A), which knows more where the structure fails. For values
/// that the model does not have, only answers that exist and differ are listed. At most eight lines. Cost:
/// one analysis of the index a line.
std::vector<std::string> parameter_cases(const Model& m, const std::vector<DeterminantFactor>& conditions);

}  // namespace pendula::dae
