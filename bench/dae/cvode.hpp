// Peers for x′ = f(t, x): CVODE (BDF or Adams) and ARKODE (explicit, order 8) of
// SUNDIALS, with our compiled f.
#pragma once

#include "ida.hpp"

namespace pendula::bench {

enum class OdePeer { bdf, adams, erk };

/// One run; the time is that of the solver alone. BDF: dense, Jacobian by
/// differences. Requires problem.is_ode().
IdaResult run_ode_peer(integrate::Problem& problem, const integrate::Point& start, OdePeer peer,
                       const IdaOptions& options);

}  // namespace pendula::bench
