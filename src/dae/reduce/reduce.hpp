// Index reduction. docs/derivations.md#reduction.
#pragma once

#include "dae/structure/analysis.hpp"

namespace pendula::dae {

/// Form "acc": every constraint is differentiated until the model has index 1 (for mechanisms: down to
/// accelerations). Derivatives that the model solves for without algebraic variables (q′ = v) are substituted
/// on the way. The original conditions become invariants of the new model. Returns the model itself if its
/// index is at most 1. See Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1 and VII.2.
ModelPtr reduce_acc(const ModelPtr& model);

/// The model, or an equivalent one whose structure is regular (conversion.hpp) where its own is not. Returns
/// the model itself if there is none.
ModelPtr regular_form(const ModelPtr& model);

struct ReduceOptions {
  std::optional<Expr> alpha, beta;           ///< gains of "baumgarte", numbers or parameters
  std::unordered_map<Expr, double> at = {};  ///< a point near which coordinates are chosen; empty: generic
};

/// reduce(form): "" chooses. Throws Error on an unknown form with the list of those that exist.
ModelPtr reduce(const ModelPtr& model, const std::string& form, const ReduceOptions& options = {});
std::vector<std::string> reduction_forms();

/// The derivation from the original model to this one, oldest step first.
std::string trace(const Model& model);

/// ∂F/∂(x′, z), columns: top_derivatives() then algebraic(). Regular exactly if the model has index at
/// most 1.
std::vector<Entry> top_jacobian(const Model& model);

}  // namespace pendula::dae
