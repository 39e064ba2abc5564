// ARX models by instrumental variables: consistent whatever the colour of the noise, as long as the input
// does not depend on it (Söderström & Stoica, Instrumental Variable Methods for System Identification, 1983;
// Ljung, 2nd ed., §7.6 and §15.3).
#pragma once

#include "sysid/model/model.hpp"

namespace pendula::sysid {

/// Four steps: least squares; instruments from the simulated output; an AR model of order na + nb
/// of the noise that is left; instruments and data filtered by it. Covariance σ² (ZᵀΦ)⁻¹ ZᵀZ
/// (ΦᵀZ)⁻¹ of the filtered quantities.
/// throws  Error on missing samples, and where the instruments do not determine θ
PolyModel iv4(const IdData& d, Index output, const Orders& orders);

}  // namespace pendula::sysid
