// Structures and consistent starts as LaTeX: fragments that compile with amsmath.
#pragma once

#include <string>

#include "dae/report/structure_report.hpp"

namespace pendula::dae {

/// Σ with offsets and transversal as an array, then the lines of describe() below it.
std::string latex(const StructureReport& structure);

/// The ledger: an array of unknowns, values and where they come from, and one of the constraints.
std::string latex(const ConsistentState& start);

}  // namespace pendula::dae
