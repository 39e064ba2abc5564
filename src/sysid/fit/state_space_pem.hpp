// State-space models by minimising prediction errors, from a model that is near: several outputs,
// missing samples of y. All entries of A, B, C, D, K and the initial states vary; the directions that
// only change the coordinates of the state leave the errors alone, and a least-squares step of minimum
// norm does not use them (McKelvey, Helmersson & Ribarits, Automatica 40(9), 2004; Wills & Ninness, IEEE
// Trans. Autom. Control 53(7), 2008).
#pragma once

#include "sysid/model/state_space.hpp"

namespace pendula::sysid {

/// min det of the covariance of the one-step errors (Ljung, 2nd ed., §7.4), by Gauss–Newton steps
/// whitened with the last covariance; with missing samples the likelihood of those that are
/// there. K = 0 stays 0 (output error).
/// throws  Error for missing inputs, models whose predictor is unstable
/// iterations: a cap on Gauss–Newton steps per pass; the result says if it was met
IdModel refined(StateSpaceModel m, const IdData& d, int iterations = 100);

}  // namespace pendula::sysid
