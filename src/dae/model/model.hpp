// A model: equations between expressions, the unknowns they contain, parameter values, and where it came
// from.
//
// A model is an immutable value. Every operation (reduce, first_order, with …) returns a new model whose
// lineage says which model it was made from, step by step (trace), and which of its symbols mean which
// expressions of its ancestors (relations): a start or an expression of one form can be used with every other
// form.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "dae/model/first_order.hpp"
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
};

/// A condition on the initial values, explicit or hidden.
struct Constraint {
  Expr residual;      ///< 0 = residual, in states, inputs, parameters and t
  int origin;         ///< index of the block it came from
  int row;            ///< row of that block
  int derivative;     ///< 0: as written; k: differentiated k times
  std::string label;  ///< "C₁", "C₁′" …
};

/// What the lagrange front end knows beyond the equations.
struct Mechanics {
  VecX q;
  Expr T, V;
  VecX C, Q, multipliers;
  std::vector<Entry> M;  ///< mass matrix W(q), n×n; what is not listed is 0
  VecX rhs;              ///< W q″ + (∂C/∂q)ᵀ z = rhs
  std::vector<Entry> dCdq;
};

/// The matrix with these entries, and zeros elsewhere.
MatX dense(const std::vector<Entry>& entries, Eigen::Index rows, Eigen::Index columns);

/// An expression that must not vanish along a solution: a form divided by it, or it is a factor of the
/// determinant of the system Jacobian.
struct Nonzero {
  Expr factor;         ///< in unknowns of the model, inputs, parameters and t
  std::string where;   ///< what goes wrong where it is 0: "(5) cannot be solved for u, as form … did"
  std::string remedy;  ///< what can be done, "" if nothing
};

/// How a solution may leave the constraints that a form was derived from (its invariants).
enum class DriftLaw {
  none,  ///< not at all: they are equations of the model, or the solution is projected onto them
  polynomial,  ///< C⁽ᵈ⁾ = 0 is imposed: C(t) = Σ C⁽ᵏ⁾(0) tᵏ/k!, k < d; for mechanisms a straight line
  decay  ///< a stable linear equation in C is imposed: what is off decays
};

/// Conditions that a solution is moved back onto after every step: the smallest change of `unknowns`, in the
/// norm √(dxᵀ W dx), with 0 = G. Stages are worked off in order: positions, then velocities.
struct Projection {
  std::vector<Expr> unknowns;   ///< states, n
  std::vector<Expr> residuals;  ///< G, m < n, in states, inputs, parameters and t
  std::vector<Entry> jacobian;  ///< ∂G/∂unknowns
  std::vector<Entry> weight;    ///< W, n×n; empty: the identity
};

/// What tells the rows of equation (3) apart: "b" in (3b); ".27" where letters do not suffice.
std::string row_letter(int row, Eigen::Index rows);
/// Of row `row` of equation `block` (from 0): "(3)", "(3b)", "(3b*)" if it is not the one that was written.
std::string row_label(const Block& b, int block, int row);

/// "ODE", "implicit ODE", "semi-explicit" or "fully implicit".
enum class Kind { ode, implicit_ode, semi_explicit, fully_implicit };
const char* kind_name(Kind kind);

struct Model {
  std::string name;
  std::vector<Block> blocks;
  std::vector<Expr> residuals;              ///< lhs - rhs of every row of every block
  std::vector<std::pair<int, int>> origin;  ///< block and row of each residual
  std::vector<Variable> variables;          ///< in order of declaration
  std::vector<Expr> inputs;                 ///< leaves of order 0
  std::vector<Expr> parameters;
  ParameterValues values;  ///< of parameters; what is missing must be given later
  Kind kind = Kind::fully_implicit;
  bool mass_matrix = false;  ///< semi-explicit after inverting a nonsingular M(x, t)

  std::string form;  ///< "" as written, "acc" …: the form reduce() made
  ModelPtr parent;
  std::vector<std::string> trace;  ///< how it was derived from the parent, line by line
  Substitution relations;          ///< leaf that is no unknown here -> expression in unknowns of this model
  std::vector<Constraint> invariants;   ///< conditions on the start that the equations no longer impose
  DriftLaw drift = DriftLaw::none;      ///< of the invariants
  std::vector<Projection> projections;  ///< form "project": for the integrator, after every step
  std::optional<Mechanics> mechanics;
  std::vector<Nonzero> domain;  ///< equivalent to the model it was made from where none of these vanishes

  std::vector<Expr> states() const;  ///< x_j^(k), k < order_j: all of order 0 first, then order 1 …
  std::vector<Expr> algebraic() const;
  std::vector<Expr> top_derivatives() const;  ///< x_j^(order_j) of the differential variables
  /// "(3)", or "(3b)" for row 2 of a column equation; "(3*)" for what has taken the place of (3).
  std::string label(std::size_t residual) const;
  std::string equation_text(std::size_t residual) const;
};

/// What distinguishes a model from a bare list of equations; all optional.
struct ModelOptions {
  std::string name;
  std::vector<Expr> x, z, u;  ///< declared unknowns and inputs; when any is given, everything else is refused
  ParameterValues values;     ///< override the parameters' defaults
  std::string form;
  ModelPtr parent;
  std::vector<std::string> trace;
  Substitution relations;
  std::vector<Constraint> invariants;
  DriftLaw drift = DriftLaw::none;
  std::vector<Projection> projections;
  std::optional<Mechanics> mechanics;
  std::vector<Nonzero> domain;
};

/// Builds and classifies a model. Throws Error: no equations, sizes differ, two symbols of one name, a symbol
/// that was not declared although x, z or u were given, a derivative of a variable declared algebraic. Cost:
/// linear in the size of the expressions, plus one rank computation of ∂F/∂x′.
ModelPtr make_model(std::vector<Block> blocks, ModelOptions options = {});

/// The same model with other parameter values. Throws Error on a parameter it does not have.
ModelPtr with_values(const ModelPtr& model, const ParameterValues& values);

/// x′ = f, 0 = g.  F(x′, x, z, u) = 0.  E x′ = A x + B u (x may be empty: made as var("x", n)).
ModelPtr semi_explicit(const VecX& x, const VecX& z, const VecX& u, const VecX& f, const VecX& g,
                       std::string name = "");
ModelPtr implicit(const VecX& x, const VecX& z, const VecX& u, const VecX& F, std::string name = "");
ModelPtr linear(const MatX& E, const MatX& A, const MatX& B, VecX x, VecX u, std::string name = "");

/// Conversions between the classes of Brenan, Campbell & Petzold §1.2. Semi-explicit: solved equations stay, otherwise x′ = δ with new
/// algebraic δ.
ModelPtr to_semi_explicit(const ModelPtr& model);
ModelPtr to_implicit(const ModelPtr& model);
/// Variables of order > 1 get their derivatives as new variables: q″ = f becomes q′ = v, v′ = f.
ModelPtr to_first_order(const ModelPtr& model);

/// The lowering for the integrators. Throws Error unless there are as many equations as unknowns.
FirstOrder first_order(const Model& model);

/// An expression in symbols of this model or of its lineage, rewritten in unknowns of this model (q.dot ->
/// v).
Expr resolve(const Model& model, Expr e);

/// An equation solved for a first derivative: x_j′ = f.
struct Solved {
  std::size_t residual;
  Expr derivative;  ///< the top derivative leaf
  Expr f;
  Expr slope = 1;  ///< its coefficient in the row, which f was divided by
};
/// Rows that contain one top derivative, linearly, with a coefficient free of unknowns; each derivative at
/// most once.
std::vector<Solved> solved_rows(const Model& model);

/// x_j⁽ᵏ⁾ = f, row by row, and no such derivative in any f. Cost: one pass over all f together.
bool is_explicit_ode(const Model& model);

/// print(model): header, numbered equations, unknowns, parameters.
std::string describe(const Model& model);

}  // namespace pendula::dae
