// The index as it is: the structural answer where it is proved, else the pencil, derivative arrays, or a
// repair.
#pragma once

#include "dae/analysis.hpp"

namespace pendula::dae {

struct Truth {
  int index = 0;                        ///< differentiation index
  int dof = 0;                          ///< free initial values
  std::vector<Constraint> constraints;  ///< conditions on the states, explicit and hidden
  bool complete = true;                 ///< the list of constraints has them all
  bool index_is_bound = false;          ///< too large for a referee: the index is at most this
  std::string by;                       ///< how it was found, in words
  std::vector<std::string> notes;       ///< what else has to be known: other branches, other parameter values
};

/// Roads, in this order: for linear systems with constant coefficients the exact shuffle algorithm
/// (pencil.hpp); else, up to a size, the derivative array (derivative_array.hpp); else the structure, if its
/// system Jacobian is regular. Conditions come from the shuffle, from differentiating by offsets where these
/// are valid, or from the repaired model.
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

}  // namespace pendula::dae
