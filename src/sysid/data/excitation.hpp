// Is the input rich enough? Persistent excitation and the reasons why parameters cannot be found.
#pragma once

#include "sysid/model/model.hpp"

namespace pendula::sysid {

/// Order of persistent excitation: the largest n ≤ limit for which u(t), …, u(t-n+1) are linearly independent
/// over the record (Ljung, 2nd ed., Def. 13.2, for a finite record). A constant has order 1, a sine order 2,
/// zero order 0. Samples that are missing end a stretch. Cost: N limit².
int excitation_order(const IdData& d, Index input, int limit);

/// Sentences: which input excites too little, what the structure of the null space says (feedback, orders too
/// high for exact data), what is missing, and what to change.
std::vector<std::string> why_not_identifiable(const IdData& d, const PolyModel& m, Index rows);

}  // namespace pendula::sysid
