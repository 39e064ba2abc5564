// A consistent start: values of every state, derivative and algebraic variable that satisfy the equations and
// all hidden constraints. `fix` is a condition, `guess` only a starting point; nothing else ever becomes an
// equation.
#pragma once

#include "base/math.hpp"
#include "dae/model.hpp"

namespace pendula::dae {

using LeafValues = std::vector<std::pair<Expr, double>>;

struct StartRequest {
  LeafValues fix;
  LeafValues guess;
  ParameterValues parameters;  ///< override the model's
  Substitution inputs;         ///< input leaf (any order) -> expression in t and parameters
  double t = 0;
  bool keep_invariants =
      true;  ///< false: a reduced form may start off the constraints it no longer imposes (drift)
};

enum class Origin { fixed, redundant, chosen, computed, given };

struct LedgerRow {
  Expr leaf;
  double value;
  Origin origin;
};

class Start {
 public:
  ModelPtr model;
  double t = 0;
  std::unordered_map<Expr, double> values;  ///< states, top derivatives, algebraic, inputs, parameters, t
  std::vector<LedgerRow> rows;
  std::vector<std::pair<Constraint, double>> constraints;  ///< with the residual at the start
  int free = 0;                                            ///< number of initial values that could be chosen

  /// The value of an expression in the symbols of this model or a relative. Throws Error naming what has no
  /// value.
  double operator()(Expr e) const;
  /// The value of a leaf of `other`, a relative of this start's model, if it is known.
  std::optional<double> value_for(const Model& other, Expr leaf) const;
  std::string ledger() const;
};
using StartPtr = std::shared_ptr<const Start>;

/// Solves the equations, the hidden constraints and the fixes together (damped Gauss-Newton, smallest step
/// first).
///
/// requires  a model whose structural analysis is regular
/// returns   values with every scaled residual below 1e-10
/// throws    Error for conflicting fixes (names the fewest that conflict and the constraint they violate),
/// for values
///           that are neither fixed nor determined (names the candidates and recommends a choice), for
///           parameters or inputs without value; Failure where no solution was found
/// cost      one complete orthogonal decomposition per iteration
StartPtr init(const ModelPtr& model, const StartRequest& request);

}  // namespace pendula::dae
