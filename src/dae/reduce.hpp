// Index analysis and index reduction by differentiation.
#pragma once

#include "dae/model.hpp"
#include "dae/sigma.hpp"

namespace pendula::dae {

/// What the structure says about a model, and whether it may be believed.
struct Analysis {
  Offsets offsets;
  int rank = 0;                         ///< generic rank of the system Jacobian
  bool regular = false;                 ///< rank = number of equations: the structural answer is valid
  int index = 0;                        ///< differentiation index where regular
  int dof = 0;                          ///< free initial values where regular
  std::vector<Constraint> constraints;  ///< conditions on the start, explicit and hidden
};

/// Σ-method, then the generic rank of the system Jacobian. Throws Error unless there are as many equations as
/// unknowns.
Analysis analyse(const Model& model);

/// The same, but throws a Failure that says why and which combination is singular unless the analysis is
/// regular.
Analysis require_regular(const Model& model);

/// Form "acc": every constraint is differentiated until the model has index 1 (for mechanisms: down to
/// accelerations). Derivatives that the model solves for without algebraic variables (q′ = v) are substituted
/// on the way. The original conditions become invariants of the new model. Returns the model itself if its
/// index is at most 1. See Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1 and VII.2; exam problem 1(b).
ModelPtr reduce_acc(const ModelPtr& model);

/// reduce(form): "" chooses. Throws Error on an unknown form with the list of those that exist.
ModelPtr reduce(const ModelPtr& model, const std::string& form);
std::vector<std::string> reduction_forms();

/// The derivation from the original model to this one, oldest step first.
std::string trace(const Model& model);

/// ∂F/∂(x′, z) of an index-1 model is regular and its unknowns are what init and integrate solve for.
MatX top_jacobian(const Model& model);

}  // namespace pendula::dae
