// The forms other than "acc". Each takes any model, returns a new one with lineage and trace, and throws an
// Error that says why where the form does not apply. docs/derivations.md#forms.
#pragma once

#include <span>

#include "base/math.hpp"
#include "dae/reduce/reduce.hpp"

namespace pendula::dae {

/// Refuses a form that would change nothing: 'form "ggl": the model has index 1 and no constraint that has
/// to be differentiated; it can be integrated as it stands', or, of a model that had to be regularised,
/// its regularised equations can.
[[noreturn]] void refuse_form(const char* form, const Model& model, const char* lacking);

/// "ggl": constraints stay as they are and their derivatives join them, with additional multipliers μ:
///   q′ = v - (∂C/∂q)ᵀ μ,   0 = C,   0 = C′;   index 2, μ = 0 on exact solutions.
/// requires  constraints differentiated twice, on variables with rows q′ = v (made where they are missing)
/// see       Gear, Leimkuhler & Gupta, J. Comput. Appl. Math. 12–13, 1985; Hairer & Wanner, Solving ODEs II,
/// 2nd ed., §VII.1
ModelPtr reduce_ggl(const ModelPtr& model);

/// "baumgarte": 0 = C″ + 2α C′ + β² C; 0 = C′ + α C after one differentiation, (d/dt + α)ᵏ C after k > 2.
/// requires  α, β > 0 where they are numbers
/// see       Baumgarte, Comput. Methods Appl. Mech. Eng. 1, 1972
ModelPtr reduce_baumgarte(const ModelPtr& model, const ReduceOptions& options);

/// "ode": multipliers and algebraic variables are eliminated from the index-1 equations: x′ = f(t, x).
/// Derivatives that have a row of their own are put in; what remains is linear in its unknowns and becomes
/// solve nodes. Algebraic variables and their relations keep their meaning (sol(z)).
/// requires  index-1 equations linear in (x′, z)
ModelPtr reduce_ode(const ModelPtr& model);

/// "project": form "ode", or "acc" where that is nonlinear, and the stages of a projection onto the
/// invariants. Mechanisms: in the norm of the mass matrix, which does not depend on units.
/// see       Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.2
ModelPtr reduce_project(const ModelPtr& model);

/// Moves the states among `values` onto the invariants of a model of form "project", stage by stage, by
/// Newton's method with least steps. values: states, inputs, parameters, t. Returns the largest change.
/// throws    Failure where Newton's method does not converge
double project(const Model& model, std::unordered_map<Expr, double>& values);

/// "array": of the equations and their derivatives up to the index, a choice of rows that determines the
/// derivatives of all unknowns at a point, as a square system of index 1: as many unknowns become algebraic
/// as there are conditions on them, and derivatives of these become variables of their own. Needs no
/// structure, only an index: where x′ follows from F_k = 0, it follows from rows as many as the rank, and
/// derivatives that no row determines may have any value (0). Valid near the point, where the chosen rows
/// stay regular (integrate/simulation/array_run chooses them again). x′ of a state that not only its own row
/// contains is an unknown of its own, x′ = x_dot.
/// requires  a model without unspecified functions; throws Failure where no regular point is found
/// see       Kunkel & Mehrmann, Differential-Algebraic Equations, 2006, §6.2; Mattsson & Söderlind 1993
ModelPtr reduce_array(const ModelPtr& model, const ReduceOptions& options);

/// "minimal": constraints are solved for dependent variables, which are substituted;
/// what remains moves freely.
///
/// requires  every constraint linear in some coordinate
ModelPtr reduce_minimal(const ModelPtr& model, const ReduceOptions& options);

/// A choice of dummy derivatives: leaves x⁽ᵏ⁾ that become algebraic variables.
struct DummySelection {
  std::vector<Expr> dummies;  ///< by variable, ascending order
  /// σ_min of the selected constraint Jacobians, divided by that of all columns to choose from, least over
  /// the groups of constraints that share variables: 1 is the best there is, 0 singular.
  double quality = 0;
  friend bool operator==(const DummySelection& a, const DummySelection& b) { return a.dummies == b.dummies; }
};

/// Chooses dummy derivatives from the numeric values of the constraint Jacobian, stage by stage: by pivoted
/// QR in small groups of constraints that share variables, by sparse elimination in large ones. Cost of best
/// and quality: near linear where the constraints are sparse.
class DummyPivoting {
 public:
  /// source: the model to be reduced, of regular structure.
  explicit DummyPivoting(const ModelPtr& source);
  std::vector<Expr> slopes;  ///< what best and quality take the values of
  /// Throws Failure where the constraint Jacobian is singular.
  DummySelection best(std::span<const double> slope_values) const;
  double quality(const DummySelection& selection, std::span<const double> slope_values) const;
  /// Random values of all leaves of `slopes`, variables in units of their own: exp(10⁹ x) has no value at
  /// x = 1. in_units_near_1: also in units within a factor of 300.
  std::unordered_map<Expr, double> generic_point(bool in_units_near_1) const;

 private:
  using Row = std::vector<std::pair<Eigen::Index, double>>;  ///< column, value
  std::vector<Row> rows(std::span<const double> numbers) const;
  std::vector<Row> of_stage(const std::vector<Row>& all, int stage, const std::vector<char>& columns) const;
  Expr dummy(Eigen::Index column, int stage) const;
  ModelPtr model_;
  Analysis analysis_;
  std::vector<Entry> entries_;
  Vec unit_;  ///< of the variables: the choice must not depend on units
};
/// The one of a model in use.
std::shared_ptr<const DummyPivoting> shared_pivoting(const ModelPtr& source);

/// The best selection at a point. `model` is the one to be reduced; the point gives states, parameters,
/// inputs and t of it; empty: a generic point, or a consistent one where the equations have no value there.
DummySelection select_dummies(const ModelPtr& model, const std::unordered_map<Expr, double>& point);
/// The meaning of a leaf of form "dummy" in the model it was made from: x_dot is x′.
Expr original_leaf(const Model& dummy, Expr leaf);
/// The selection that a model of form "dummy" was made with.
DummySelection selection_of(const Model& dummy);

/// "dummy": all equations and all derivatives of them, index 1, with this selection; the last ones made are
/// remembered, since runs change from one to another and back.
/// see       Mattsson & Söderlind, SIAM J. Sci. Comput. 14(3), 1993
ModelPtr reduce_dummy(const ModelPtr& model, const DummySelection& selection);
ModelPtr reduce_dummy(const ModelPtr& model, const ReduceOptions& options);

}  // namespace pendula::dae
