// Linear systems with constant coefficients, E x′ = A x + B u + f(t), exact over ℚ:
// docs/derivations.md#pencil.
//
// The pencil sE - A decides everything: it is regular where det(sE - A) is not identically zero; then the
// degree of the determinant is the number of free initial values, and matrices S, T exist with
//   S E T = diag(I, N),  S A T = diag(J, I),  N nilpotent                    (Weierstrass form)
// so that x = T (x₁, x₂) with x₁′ = J x₁ + (S g)₁ and x₂ = -Σᵢ Nⁱ (S g)₂⁽ⁱ⁾, g = B u + f. The nilpotency
// index of N is the differentiation index. S and T come from the Wong sequences
//   Vₖ₊₁ = A⁻¹(E Vₖ), V₀ = ℝⁿ  and  Wₖ₊₁ = E⁻¹(A Wₖ), W₀ = 0:   T = [V W], S = [E V, A W]⁻¹
// of Berger, Ilchmann & Trenn, The quasi-Weierstrass form for regular matrix pencils, Linear Algebra Appl.
// 436(10), 2012. N is in Jordan form, and so is the part of J whose eigenvalues are rational.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dae/model/model.hpp"
#include "dae/pencil/pencil_modes.hpp"
#include "dae/rank/rational_matrix.hpp"

namespace pendula::dae {

/// E x′ = A x + B u + f. A variable of order k > 1 is lowered without new names: its states are the leaves x,
/// x′ …, and the rows that tie them together come first.
struct LinearForm {
  RationalMatrix E, A, B;
  std::vector<Expr> x;  ///< the unknowns in their order, then x′, x″ … that are states
  std::vector<Expr> u;  ///< the input leaves that occur linearly; derivatives of inputs are separate
  VecX f;               ///< what contains neither x nor u: t, parameters, other functions of the inputs
  /// Of each row: block and row of the model, as Model::origin; none for a tie.
  std::vector<std::optional<std::pair<int, int>>> origin;
  std::vector<std::string> label;  ///< of each row: "(3)"
  ParameterValues values;          ///< of all parameters; those in E and A have been put in
  std::vector<Expr> used;          ///< the parameters whose values were put in

  int rows() const { return E.rows(); }
  int size() const { return E.cols(); }
  VecX forcing() const;  ///< g = B u + f
};

/// Nothing if the model is not linear with constant rational coefficients (parameters have their values), or
/// has more than `most` unknowns; `reason`, if given, then says why, naming the equation and the term.
/// `values` override those of the model. Cost: one gradient per equation, up to the first that is not linear.
std::optional<LinearForm> linear_form(const Model& model, std::string* reason = nullptr,
                                      const ParameterValues& values = {}, int most = 300);

/// The quantities that index analysis needs, without transformations: fast and sparse (a
/// second for a hundred equations).
struct LinearIndex {
  bool regular = false;  ///< the rest is meaningless if not
  int index = 0, dof = 0;
  std::vector<Constraint> constraints;  ///< conditions on the states: explicit, then hidden
  std::vector<Constraint> algebraic;    ///< conditions from which the algebraic variables follow
};
/// By the shuffle algorithm (pencil_shuffle.hpp), exactly.
LinearIndex linear_index(const LinearForm& form);

/// Polynomial combinations that make a pencil singular: y(s)ᵀ(sE - A) = 0 or
/// (sE - A) x(s) = 0 of least degree.
struct PolynomialVector {
  RationalMatrix coefficient;  ///< column k belongs to sᵏ; coprime integers
};

struct Pencil {
  LinearForm form;
  bool regular = false;

  // ── singular ──
  int rank = 0;                           ///< of sE - A at almost every s
  std::vector<PolynomialVector> rows;     ///< combinations of equations without x: redundant or contradictory
  std::vector<PolynomialVector> columns;  ///< unknowns that the equations leave open

  // ── regular ──
  Polynomial det;  ///< det(sE - A), lowest power first
  int dof = 0, index = 0;
  std::vector<Mode> modes;                         ///< the zeros of det, by real part
  RationalMatrix S, T, J, N;                       ///< J: dof × dof
  std::vector<Constraint> constraints, algebraic;  ///< as in LinearIndex

  /// Basis of the x(0) that are consistent with g = 0; shifted by inputs otherwise.
  RationalMatrix basis() const { return T.columns(0, dof); }
};

/// Throws an internal error if the exact check of S E T, S A T, of the determinant, or of the constraints
/// against the shuffle algorithm fails. Cost: O(index · n³) operations on rationals.
Pencil pencil(const LinearForm& form);

/// linear_form and pencil; throws Error with the reason where the model is not linear.
Pencil pencil(const Model& model);

/// print(pencil).
std::string describe(const Pencil& p);

/// Interpretation of the rows and columns of a singular pencil: "(3) - (1) - (2) reads 0 = f3 - f1 - f2 …".
std::string describe_singular(const Pencil& p);

// ── solution (pencil_solution.cpp) ──

/// x(t) for t ≥ `from`.
///
/// x0        conditions x_j(from) = value; values may contain parameters. Too few are an
///           Error that names what is free, contradictions to the constraints an Error that shows the
///           residual. With `general` the free values are the constants c1 … instead.
/// inputs    input leaf -> expression in t; polynomials, exponentials, sines and cosines of linear
///           arguments with rational rates (or roots of rationals as frequencies), and their products. Where
///           there is nothing to integrate (dof = 0), any function, given or not.
/// returns   exact expressions where the modes are rational or quadratic, else decimals in them
struct SolutionRequest {
  std::vector<std::pair<Expr, Expr>> x0;
  Substitution inputs;
  mpq_class from = 0;
  bool general = false;
};
VecX solution(const Pencil& p, const SolutionRequest& request);

}  // namespace pendula::dae
