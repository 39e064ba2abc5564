// Steps of the subspace method that run through the data with a model.
#pragma once

#include "sysid/model/state_space.hpp"

namespace pendula::sysid {

/// B, D (if m.feedthrough) and x0 from A, C, K: the one-step errors are linear in them.
void fit_inputs(StateSpaceModel& m, const IdData& d);
/// The model with criteria, fits and innovations per output.
IdModel completed(StateSpaceModel m, const IdData& d, bool exact);

}  // namespace pendula::sysid
