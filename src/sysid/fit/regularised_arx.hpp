// FIR and ARX models with a prior on their impulse responses (sysid/regression/kernel).
#pragma once

#include "sysid/model/model.hpp"
#include "sysid/regression/kernel.hpp"

namespace pendula::sysid {

/// One group per polynomial: A, and B of every input. Criteria count the effective number of parameters
/// (Ljung, 2nd ed., §16.4, with trace of the smoother). ic = "estimate" is not available.
/// throws  Error on missing rows
PolyModel regularised_arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
                          Kernel kernel);

}  // namespace pendula::sysid
