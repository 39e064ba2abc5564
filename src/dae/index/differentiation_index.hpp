// The index as it is: the structural answer where it is proved, else the pencil, derivative arrays, or a
// repair. docs/derivations.md#index.
#pragma once

#include "dae/structure/analysis.hpp"

namespace pendula::dae {

struct Truth {
  int index = 0;                   ///< differentiation index
  int dof = 0;                     ///< free initial values
  bool index_is_bound = false;     ///< too large for a referee: the index is at most this
  std::string by;                  ///< how it was found, in words
  std::vector<std::string> notes;  ///< what else has to be known: other branches, other parameter values

  enum class Conditions { found, by_offsets, of_repaired } conditions = Conditions::by_offsets;
  std::vector<Constraint> found;  ///< conditions that the road itself wrote down
  bool complete = true;           ///< … and these are all
};

/// Conditions on the states, explicit and hidden.
struct Consistency {
  std::vector<Constraint> constraints;
  bool complete = true;  ///< elimination reached them all
};

/// Roads, in this order: for linear systems with constant coefficients the exact shuffle algorithm
/// (pencil.hpp); else, up to a size, the derivative array (derivative_array.hpp); else the structure, if its
/// system Jacobian is regular.
///
/// Where the derivative array and the structure disagree, the array decides if the system Jacobian is
/// singular on the solutions, the structure if there are consistent points where it is regular; the other
/// answer is then in the notes. Answers are remembered by the equations and parameter values.
///
/// requires  as many equations as unknowns (throws Error)
/// throws    Failure that says what each road found, where none leads to an index: singular systems, an index
///           that depends on the point
Truth truth(const Model& model, const Analysis& analysis);
Truth truth(const Model& model);

/// The conditions, from the shuffle, from differentiating by offsets where these are valid, or from the
/// repaired model. Up to 500 equations everything but states is eliminated from them. Remembered.
///
/// throws    as `truth`
/// cost      that of `truth` and of the derivatives: index 11 means the tenth
Consistency consistency(const Model& model);

}  // namespace pendula::dae
