// Index reduction: forms of a model that integrators can use.
//
// reduce.hpp (here): form "acc" and the entry reduce(form). reduced_forms.hpp declares the others: "dummy"
// (reduce_dummy, dummy_pivoting), "project", "ggl" and "baumgarte" (reduce_stabilised), "ode", "minimal".
// reduce_choice.cpp chooses one. A form is a new model with lineage: its relations translate every symbol of
// the original model, its invariants are the conditions that it no longer imposes, its singularity_conditions
// what it divided by, its trace the derivation. docs/derivations.md#reduction.
#pragma once

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

/// Form "acc": every constraint is differentiated until the model has index 1 (for mechanisms: down to
/// accelerations). Derivatives that the model solves for without algebraic variables (q′ = v) are substituted
/// on the way. The original conditions become invariants of the new model. Returns the model itself if its
/// index is at most 1. See Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1 and VII.2.
ModelPtr reduce_acc(const ModelPtr& model);

/// A form of index at most 1 for consistent values: reduce_acc(), and form "array" (reduced_forms.hpp) where
/// differentiating by offsets does not lead to one although there is an index. near: values near which rows
/// are chosen, as many as are known.
ModelPtr index_one_form(const ModelPtr& model, const std::unordered_map<Expr, double>& near = {});

struct ReduceOptions {
  std::optional<Expr> alpha, beta;           ///< gains of "baumgarte", numbers or parameters
  std::unordered_map<Expr, double> at = {};  ///< a point near which coordinates are chosen; empty: generic
};

/// reduce(form): "" chooses. Throws Error on an unknown form with the list of those that exist.
ModelPtr reduce(const ModelPtr& model, const std::string& form, const ReduceOptions& options = {});
std::vector<std::string> reduction_forms();

/// ∂F/∂(x′, z), columns: top_derivatives() then algebraic(). Regular exactly if the
/// model has index at most 1.
std::vector<Entry> top_jacobian(const Model& model);

}  // namespace pendula::dae
