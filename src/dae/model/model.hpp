// Models: equations between expressions, the unknowns they contain, parameter
// values, and where they came from.
//
// This folder knows what a model is and how one is made from another, and nothing about its index: model.hpp
// the value, make_model.hpp its construction, forms.hpp the classes of the textbooks and their conversions,
// first_order.hpp and solved_rows.hpp the views that integrators and reductions take, lineage.hpp what a
// derived model inherits, derivation_markup.hpp the lines of a derivation, model_key.hpp the key under which
// answers about a model are cached.
//
// A model is an immutable value. Every operation (reduce, first_order, with …) returns a new
// model whose lineage says which model it was made from, step by step (trace), and which of its
// symbols mean which expressions of its ancestors (relations): a start or an expression of one
// form can be used with every other form.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::dae {

struct Model;
using ModelPtr = std::shared_ptr<const Model>;
using ParameterValues = std::unordered_map<Expr, Expr>;

/// One equation as the user wrote it: scalar or column; it has one number.
struct Block {
  VecX lhs, rhs;
  std::string note;  ///< "d²/dt² of (3)", or empty
  /// How a row came into the place of the one that the user wrote, "" where it did not; empty: no row did.
  /// Such a row is called (3b*).
  std::vector<std::string> rewritten = {};
};

/// An unknown function of time and the highest derivative of it that occurs.
struct Variable {
  Expr leaf;
  int order;
  friend bool operator==(const Variable&, const Variable&) = default;
};

/// A condition on the initial values, explicit or hidden.
struct Constraint {
  Expr residual;              ///< 0 = residual, in states, inputs, parameters and t
  std::optional<int> origin;  ///< index of the block it came from; none: a combination of several
  int row;                    ///< row of that block
  int derivative;             ///< 0: as written; k: differentiated k times
  std::string label;          ///< "C₁", "C₁′" …
};

/// Mechanical quantities of a model made by lagrange, beside its equations.
struct Mechanics {
  VecX q;
  Expr T, V;
  VecX C, Q, multipliers;
  std::vector<Entry> M;  ///< mass matrix W(q), n×n; what is not listed is 0
  VecX rhs;              ///< W q″ + (∂C/∂q)ᵀ z = rhs
  std::vector<Entry> dCdq;
  std::vector<std::pair<VecX, VecX>> forces = {};  ///< points p(q) and forces F that Q was made of, if known
};

/// The matrix with these entries, and zeros elsewhere.
MatX dense(const std::vector<Entry>& entries, Eigen::Index rows, Eigen::Index columns);

/// An expression that must not vanish along a solution: a form divided by it, or it is a factor of the
/// determinant of the system Jacobian.
struct SingularityCondition {
  Expr factor;         ///< in unknowns of the model, inputs, parameters and t
  std::string where;   ///< what goes wrong where it is 0: "(5) cannot be solved for u, as form … did"
  std::string remedy;  ///< what can be done, "" if nothing
};

/// How a solution may leave the constraints that a form was derived from (its invariants).
enum class DriftLaw {
  none,  ///< not at all: they are equations of the model, or the solution is projected onto them
  polynomial,  ///< C⁽ᵈ⁾ = 0 is imposed: C(t) = Σ C⁽ᵏ⁾(0) tᵏ/k!, k < d; for mechanisms a straight line
  decay  ///< C′ + αC = 0, C″ + 2αC′ + β²C = 0 or (d/dt + α)ᵏC = 0 is imposed: what is off decays
};

/// Conditions that a solution is moved back onto after every step: the smallest change of `unknowns`, in the
/// norm √(dxᵀ W dx), with 0 = G. Stages are worked off in order: positions, then velocities.
struct Projection {
  std::vector<Expr> unknowns;   ///< states, n
  std::vector<Expr> residuals;  ///< G, m < n, in states, inputs, parameters and t
  std::vector<Entry> jacobian;  ///< ∂G/∂unknowns
  std::vector<Entry> weight;    ///< W, n×n; empty: the identity
};

/// The suffix that distinguishes the rows of equation (3): "b" in (3b); ".27" where letters do not suffice.
std::string row_letter(int row, Eigen::Index rows);
/// Of row `row` of equation `block` (from 0): "(3)", "(3b)", "(3b*)" if it is not the one that was written.
std::string row_label(const Block& b, int block, int row);

/// Which roots of a condition are events; the numbers are those of scripts. falling_or_negative and
/// rising_or_positive: also a start or restart at which the condition is beyond its root.
enum class Direction : signed char {
  falling_or_negative = -2,
  falling = -1,
  both = 0,
  rising = 1,
  rising_or_positive = 2
};
/// -1, 1, or 0 for both.
constexpr int sign_of_slope(Direction d) {
  return (d > Direction::both ? 1 : 0) - (d < Direction::both ? 1 : 0);
}
constexpr bool counts_beyond(Direction d) {
  return d == Direction::falling_or_negative || d == Direction::rising_or_positive;
}
/// Roots with one sign of the slope, and nothing else.
constexpr bool is_strict(Direction d) { return d == Direction::falling || d == Direction::rising; }

/// An event that belongs to the equations of a model: its action where an expression becomes zero.
struct Transition {
  Expr when;  ///< its roots are the moments; in leaves of the model or of its lineage, t too
  Direction direction = Direction::both;
  bool stop = false;                         ///< the run ends there
  std::vector<std::pair<Expr, Expr>> reset;  ///< state -> its value after, in the values before
};

/// "ODE", "implicit ODE", "semi-explicit" or "fully implicit".
enum class ModelKind { ode, implicit_ode, semi_explicit, fully_implicit };
const char* kind_name(ModelKind kind);

/// Everything that a model has beside its list of equations.
struct ModelAttributes {
  std::string name;
  ParameterValues values;  ///< of parameters; what is missing must be given later
  std::string form;        ///< "" as written, "acc" …: the form reduce() made
  ModelPtr parent;
  std::vector<std::string> trace;  ///< how it was derived from the parent, line by line
  Substitution relations;          ///< leaf that is no unknown here -> expression in unknowns of this model
  std::vector<Constraint> invariants;   ///< conditions on the start that the equations no longer impose
  DriftLaw drift = DriftLaw::none;      ///< of the invariants
  std::vector<Expr> decay;              ///< α and β of DriftLaw::decay, numbers or made of parameters
  std::vector<Projection> projections;  ///< form "project": for the integrator, after every step
  std::vector<Expr> vanishing;  ///< unknowns that are 0 on every solution: the multipliers of form "ggl"
  std::optional<Mechanics> mechanics;
  ModelPtr dependent;  ///< of independent(): with all constraints; elsewhere others may have to be kept
  /// Equivalent to the model it was made from where none of these vanishes.
  std::vector<SingularityCondition> singularity_conditions;
  std::vector<Transition> events;  ///< in every run of the model
  /// Leaf -> number or expression in parameters: what the start fixes, and where it begins to search, unless
  /// the user says something else about this leaf.
  std::vector<std::pair<Expr, Expr>> start_values, start_guesses;
};

struct Model : ModelAttributes {
  std::vector<Block> blocks;
  std::vector<Expr> residuals;              ///< lhs - rhs of every row of every block
  std::vector<std::pair<int, int>> origin;  ///< block and row of each residual
  std::vector<Variable> variables;          ///< in order of declaration
  std::vector<Expr> inputs;                 ///< leaves of order 0
  std::vector<Expr> parameters;
  ModelKind kind = ModelKind::fully_implicit;
  bool mass_matrix = false;  ///< semi-explicit after inverting a nonsingular M(x, t)

  std::vector<Expr> states() const;  ///< x_j^(k), k < order_j: all of order 0 first, then order 1 …
  std::vector<Expr> algebraic() const;
  std::vector<Expr> top_derivatives() const;  ///< x_j^(order_j) of the differential variables
  /// "(3)", or "(3b)" for row 2 of a column equation; "(3*)" for what has taken the place of (3).
  std::string label(std::size_t residual) const;
  std::string equation_text(std::size_t residual) const;
};

}  // namespace pendula::dae
