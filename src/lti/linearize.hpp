// Linear systems from differential-algebraic equations at a point.
#pragma once

#include "dae/start/start.hpp"
#include "lti/system.hpp"

namespace pendula::lti {

struct LinearizeRequest {
  std::vector<Expr> inputs;   ///< leaves; empty: the inputs of the model
  std::vector<Expr> outputs;  ///< expressions in the model's symbols; empty: the states
  std::vector<std::string> output_names;
};

/// The state space of small deviations δx, δu from a point, states by the names of the model's variables.
///
/// The model 0 = F(x′, x, z, u) is expanded to first order, ∂F/∂x′ δx′ + ∂F/∂x δx + ∂F/∂z δz + ∂F/∂u δu = 0,
/// with the values of the start. Where ∂F/∂(x′, z) is regular (index ≤ 1) this is solved for δx′ and δz. A
/// model of higher index is linearised the same way at an equilibrium, and its pencil gives the dynamics in
/// as many of its own variables as there are degrees of freedom (Kunkel & Mehrmann, Differential-Algebraic
/// Equations (2006), §2; Campbell, Linearization of DAEs along trajectories, ZAMP 46, 1995); away from an
/// equilibrium its form "acc" is linearised on the tangent space of its constraints.
///
/// requires  a start of this model
/// returns   exact entries where values and derivatives are rational; notes say whether the point is an
///           equilibrium, and by which method the result was found
/// throws    Error for inputs and outputs that are not of this model, outputs that depend on derivatives of
///           inputs, models without a regular linearisation
/// cost      one sparse Jacobian; of higher index an exact pencil (at most 60 unknowns)
System linearize(const dae::ModelPtr& model, const dae::ConsistentState& at,
                 const LinearizeRequest& request = {});

}  // namespace pendula::lti
