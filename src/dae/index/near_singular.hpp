// Models whose index hangs on a number that may be a rounding error: both answers.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

/// "index 2, 1 free initial value"
std::string answer_text(int index, int dof);

/// A second answer, with constants of the size of rounding errors taken as 0: 0.1 + 0.2 - 0.3 among numbers
/// of size 1, 100·1.1 - 110. Decimals as typed are exact and do not count.
///
/// here       the answer as given; answer_in: that of another model
/// cost       one more analysis where there are such constants
/// returns    "near-singular: 5.55e-17 in (1) …"; nothing where there are none or the answer is the same
std::optional<std::string> note_on_rounding(const Model& model, const std::string& here,
                                            const std::function<std::string(const Model&)>& answer_in);

/// What it is if pivots of the system Jacobian that differ by more than rounding explains are
/// counted as 0. Up to 12 unknowns.
std::optional<std::string> note_on_pivots(const Model& model, const Analysis& analysis,
                                          const std::string& here);

}  // namespace pendula::dae
