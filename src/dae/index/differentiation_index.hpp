// Differentiation index and degrees of freedom of a model, and its hidden constraints.
//
// One question, several methods: the exact shuffle algorithm for linear systems with constant coefficients
// (pencil/), ranks of the derivative array (array_index.hpp) at points that satisfy it (points/), the
// structural analysis where its system Jacobian is regular (analysis/), and the structure of regularised
// equations (regularise/). structural_index_check.hpp compares structure and derivative array;
// hidden_constraints.hpp and array_conditions.hpp write the conditions on the states down; near_singular.hpp
// says what small numbers would change. differentiation_index() here asks the methods in an order from exact
// to numeric and says by which evidence the answer is known. docs/derivations.md#index.
#pragma once

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

struct IndexResult {
  int index = 0;                ///< differentiation index
  int dof = 0;                  ///< free initial values
  bool index_is_bound = false;  ///< too large for a referee: the index is at most this
  bool is_unconfirmed = false;  ///< by the structure alone: no values that satisfy the equations were found
  std::string evidence;         ///< how it was found, in words
  std::vector<std::string> notes;  ///< what else has to be known: other branches, other parameter values

  enum class Conditions { found, by_offsets, of_regularised } conditions = Conditions::by_offsets;
  std::vector<Constraint> found;  ///< conditions that the method itself wrote down
  bool complete = true;           ///< … and these are all
};

/// Conditions on the states, explicit and hidden.
struct HiddenConstraints {
  std::vector<Constraint> constraints;
  bool complete = true;  ///< elimination reached them all
};

/// Methods, in this order: for linear systems with constant coefficients the exact shuffle algorithm
/// (pencil.hpp); else, up to a size, the derivative array (derivative_array.hpp); else the structure, if its
/// system Jacobian is regular.
///
/// Where the derivative array and the structure disagree, the array decides if the system Jacobian is
/// singular on the solutions, the structure if there are consistent points where it is regular; the other
/// answer is then in the notes. Answers are remembered by the equations and parameter values.
///
/// requires  as many equations as unknowns (throws Error)
/// throws    Failure that says what each method found, where none leads to an index: singular systems, an
///           index that depends on the point
IndexResult differentiation_index(const Model& model, const Analysis& analysis);
IndexResult differentiation_index(const Model& model);

/// The conditions, from the shuffle, from differentiating by offsets where these are valid, or from the
/// regularised model. Up to 500 equations everything but states is eliminated from them. Remembered.
///
/// throws    as differentiation_index()
/// cost      that of differentiation_index() and of the derivatives: index 11 means the tenth
HiddenConstraints hidden_constraints(const Model& model);

}  // namespace pendula::dae
