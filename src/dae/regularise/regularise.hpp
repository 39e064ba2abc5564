// Regularisation: equivalent equations whose structural analysis is right.
//
// The structural index of a model holds only where its system Jacobian J is regular. Where J is singular by
// its structure, parameter values, or on the solutions, this folder looks for equivalent equations with a
// regular J: elimination.hpp takes out leading derivatives that cancel, null_vectors.hpp finds dependent rows
// and columns of J, linear_combination.cpp and substitution.cpp convert the equations with their null
// vectors (docs/derivations.md#conversion), and this header applies all of them until J is regular. Callers:
// index (the bound that such equations give), reduce and start (which need a regular structure),
// singular (where the conversion divides by something that can vanish).
//
// Tried in this order, the structure computed again after each step:
//   1. derivatives that cancel within an equation are taken out, constant rows eliminated (elimination.hpp);
//   2. a new unknown w = u_j + r u_k, r a number, where several equations contain the algebraic unknowns u_j
//   and
//      u_k only in this combination (the torques of a robot arm that act as their difference);
//   3. linear combination: with u(t, x, …) in the left null space of the system Jacobian, free of derivatives
//      of order d_j - c or more, Σ u_i F_i^(c_i - c) replaces an equation l with c_l = c, where u_l ≠ 0;
//   4. substitution: with v in the right null space, new unknowns w_j = x_j^(d_j - C) - (v_j/v_l) x_l^(d_l -
//   C)
//      for shared combinations, where v_l ≠ 0.
// Every step lowers the value of the greatest transversal, so it ends. See Tan, Nedialkov & Pryce, BIT 57(3),
// 2017, §3 and §4.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dae/regularise/elimination.hpp"

namespace pendula::dae {

struct Regularised {
  ModelPtr model;                ///< equivalent; same unknowns, then new ones; regular structure
  std::vector<Block> blocks;     ///< its equations, numbered as in the original, new ones behind them
  std::vector<std::string> log;  ///< what was done, line by line
  std::vector<Expr> nonzero;     ///< equivalent where none of these vanishes; empty: everywhere
  Substitution definitions;      ///< new unknown -> the expression in original ones that it stands for
  Offsets offsets;               ///< of the regularised model
  int dof = 0;                   ///< free initial values
  /// How often the original equations have to be differentiated at most: an upper bound of the index, since
  /// the regularised equations contain derivatives of the original ones. derivative_array() gives the index.
  int differentiations = 0;
};

/// Nothing if the structure is regular already (generically and at the model's parameter values), or if no
/// conversion makes it so; `why` then receives what was tried. A structure that is singular only at the
/// given parameter values is regularised with these values put in. Requires as many equations as unknowns.
std::optional<Regularised> regularise(const ModelPtr& model, std::vector<std::string>* why = nullptr);

/// The model, or an equivalent one whose structure is regular where its own is not. Returns
/// the model itself if there is none.
ModelPtr regular_form(const ModelPtr& model);

/// One conversion of a kind. Where it is valid is added to e.nonzero, new unknowns to `definitions`.
Step convert_by_shared_pair(Equations& e, const Structure& s, std::vector<std::string>& log,
                            Substitution& definitions);
Step convert_by_combination(Equations& e, const Structure& s, std::vector<std::string>& log);
Step convert_by_substitution(Equations& e, const Structure& s, std::vector<std::string>& log,
                             Substitution& definitions);

}  // namespace pendula::dae
