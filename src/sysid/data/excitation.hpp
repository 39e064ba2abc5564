// Is the input rich enough? Persistent excitation.
#pragma once

#include "sysid/data/iddata.hpp"

namespace pendula::sysid {

/// Order of persistent excitation: the largest n ≤ limit for which u(t), …, u(t-n+1) are linearly independent
/// over the record (Ljung, 2nd ed., Def. 13.2, for a finite record). A constant has order 1, a sine order 2,
/// zero order 0. Samples that are missing end a stretch. Cost: N limit².
int excitation_order(const IdData& d, Index input, int limit);

}  // namespace pendula::sysid
