// Repairing a model whose structure lies: equivalent equations whose system Jacobian is regular.
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
// 2017, §3 and §4. docs/derivations.md#conversion.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dae/structure/elimination.hpp"

namespace pendula::dae {

struct Repaired {
  ModelPtr model;                  ///< equivalent; same unknowns, then new ones; regular structure
  std::vector<Block> blocks;       ///< its equations, numbered as in the original, new ones behind them
  std::vector<std::string> story;  ///< what was done, line by line
  std::vector<Expr> nonzero;       ///< equivalent where none of these vanishes; empty: everywhere
  Substitution definitions;        ///< new unknown -> the expression in original ones that it stands for
  Offsets offsets;                 ///< of the repaired model
  int dof = 0;                     ///< free initial values
  /// How often the original equations have to be differentiated at most: an upper bound of the index, since
  /// the repaired equations contain derivatives of the original ones. derivative_array() tells the index.
  int differentiations = 0;
};

/// Nothing if the structure is regular already (generically and at the model's parameter values), or if no
/// conversion makes it so; `why` then receives what was tried. A structure that is singular only at the
/// given parameter values is repaired with these values put in. Requires as many equations as unknowns.
std::optional<Repaired> repair(const ModelPtr& model, std::vector<std::string>* why = nullptr);

/// One conversion of a kind. Where it is valid is added to e.nonzero, new unknowns to `definitions`.
Step convert_by_shared_pair(Equations& e, const Structure& s, std::vector<std::string>& story,
                            Substitution& definitions);
Step convert_by_combination(Equations& e, const Structure& s, std::vector<std::string>& story);
Step convert_by_substitution(Equations& e, const Structure& s, std::vector<std::string>& story,
                             Substitution& definitions);

}  // namespace pendula::dae
