// Consistent initial values.
//
// start_system: the equations of a start (index-1 form, invariants, fixed values) in units of their own,
// estimated in start_magnitudes. start_solve: damped Gauss-Newton through a list of attempts. start_freedom:
// which values are still free. start_nearest: contradictory values moved as little as possible.
// start_branches: other solutions for the same fixed values. start_conflict: values without a start,
// interval_proof: whether that is proved. start_errors: other messages. ledger: the printed table.
//
// A consistent start has values of every state, derivative and algebraic variable that satisfy the equations
// and all hidden constraints. `fix` is a condition, `guess` only a starting point; nothing else ever becomes
// an equation. docs/derivations.md#start.
#pragma once

#include <optional>

#include "base/math.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

using LeafValues = std::vector<std::pair<Expr, double>>;

struct StartRequest {
  LeafValues fix;
  LeafValues guess;
  LeafValues
      declared;  ///< starts of parts whose unknown has a guess, too: they hold where nothing contradicts
  ParameterValues parameters;  ///< override the model's
  Substitution inputs;         ///< input leaf (any order) -> expression in t and parameters
  double t = 0;
  std::vector<Expr> numeric_inputs;  ///< those whose value at t is all that is known: no derivatives
  bool keep_invariants =
      true;          ///< false: a reduced form may start off the constraints it no longer imposes (drift)
  LeafValues sizes;  ///< how large values have been on the way here, where a run asks: what 0 is measured by
  bool of_run = false;   ///< fix came as start = { … } of a run: messages write it so
  bool nearest = false;  ///< contradictory fixes move as little as possible, in units of their own
};

enum class Origin { fixed, redundant, chosen, computed, moved };

/// A fixed value that `nearest` changed.
struct Moved {
  Expr leaf;
  double from, to;
};

/// Another solution of the equations with the same fixes: the unknowns in which it differs.
struct Branch {
  Expr leaf;  ///< the unknown to guess
  double here, there;
  std::string formula;  ///< "x = ±√(L² - y²)", where the unknown solves a quadratic equation
};

/// Values without digits: rounding errors of the equations leave them open by about this much.
struct LostDigits {
  std::vector<Expr> leaves;  ///< the worst one; at a double root all that are open
  double error;
  bool is_double_root = false;
};

struct LedgerRow {
  Expr leaf;
  double value;
  Origin origin;
};

class ConsistentState {
 public:
  ModelPtr model;
  /// Of a piecewise model: what holds from here on, and derivatives follow from; else nullptr.
  ModelPtr piece;
  double t = 0;
  std::unordered_map<Expr, double> values;  ///< states, top derivatives, algebraic, inputs, parameters, t
  std::unordered_map<Expr, double>
      units;  ///< of values that were computed: what their rounding is measured by
  std::vector<LedgerRow> rows;
  std::vector<std::pair<Constraint, double>> constraints;  ///< with the residual at the start
  int free = 0;                                            ///< number of initial values that could be chosen
  bool free_is_bound = false;  ///< an upper bound, where the equations lose rank and derivatives do not tell
  std::vector<Moved> moved;    ///< by `nearest`
  std::optional<LostDigits> lost;  ///< small models only
  StartRequest request;            ///< what it was made from

  /// The value of an expression in the symbols of this model or a relative. Throws
  /// Error naming what has no value.
  double operator()(Expr e) const;
  /// The value of a leaf of `other`, a relative of this start's model, if it is known.
  std::optional<double> value_for(const Model& other, Expr leaf) const;
  std::string ledger() const;
  /// "rounding errors of the equations leave z = … uncertain by about …", or "".
  std::string lost_digits_text() const;
  /// Other roots that the equations have for the same fixes, found from mirrored starting points; at most a
  /// few, small models only. Cost: some further solves.
  std::vector<Branch> branches() const;
  /// Those of x′ and z that no guess has chosen, for a run: other solutions begin at the same states. One
  /// line each; "" for reduced forms.
  std::string unchosen_roots_text() const;
  /// "z = 0 here, where solutions meet: …" where the equations do not determine x′ and z at this start and
  /// several solutions go on; else "". Small models as they were given only.
  std::string crossing() const;
};
using ConsistentStatePtr = std::shared_ptr<const ConsistentState>;

/// Solves the equations, the hidden constraints and the fixes together (damped Gauss-Newton, least steps in
/// the units of the unknowns: the result does not depend on the units that the model is written in).
///
/// requires  a model whose structural analysis is regular, or can be regularised
/// returns   values at which every equation holds to the rounding errors of its evaluation; fixed values that
///           others determine may be off by 1e-9
/// throws    Error for conflicting fixes (names the fewest that conflict and the equation that they violate),
///           for values that are neither fixed nor determined (names the candidates, the null vector, and a
///           call that works), for equations without value at the guess, for parameters or inputs without
///           value; Failure where no solution was found
/// cost      per iteration one complete orthogonal decomposition; above 250 unknowns a sparse factorisation
ConsistentStatePtr init(const ModelPtr& model, const StartRequest& request);

}  // namespace pendula::dae
