// The equations of a consistent start, in units of their own: residuals of the index-1 form, the invariants
// it no longer imposes, and one row per fixed value.
//
// Every unknown w_j is measured in a unit s_j and every residual r_i in a unit σ_i, estimated from the terms
// of the equations (magnitudes()), so that a model written in nanometres has the same start as one in metres.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <optional>

#include "base/math.hpp"
#include "dae/newton/least_step.hpp"
#include "dae/rank/magnitudes.hpp"
#include "dae/start/start.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {

/// Conditions by how often equations were differentiated for them, then the equations of index 1; an
/// unknown belongs to the first level that contains it. Where that is often, each level is solved with
/// those below it held, as Pryce (BIT 41(2), 2001, §3) solves for Taylor coefficients: the ninth
/// derivative has terms of all sizes.
struct StartLevels {
  static constexpr int high = 5;        ///< derivatives from which on levels are held
  int highest = -1;                     ///< of the conditions; the equations are highest + 1
  std::vector<int> of_row, of_unknown;  ///< rows that are no fixes; unknowns
};

/// The part of a StartSystem that depends on which values are fixed, not on the
/// values: starts of one kind share it.
struct StartEquations {
  ModelPtr model, low;
  std::vector<Expr> unknowns, rows;
  std::vector<Expr> fixed;  ///< what stands for the values in the rows of the fixes
  std::vector<Expr> given;  ///< leaves with a value of their own: t, parameters, `fixed`
  std::size_t state_count = 0, first_fix = 0;
  std::unordered_map<Expr, Eigen::Index> column;
  std::vector<std::optional<Eigen::Index>>
      fixed_unknown;  ///< by fix; nothing if it is an expression in several
  std::vector<Entry> jacobian;
  Eigen::SparseMatrix<double> pattern;
  std::vector<Eigen::Index> place;          ///< of each entry of the Jacobian among the values of the pattern
  std::optional<Evaluator> values, slopes;  ///< of rows and jacobian, in unknowns and `given`
  std::vector<std::string> labels;          ///< of the rows before the fixes
  bool has_signs = false;                   ///< the equations of the model contain sign()
  Substitution inputs;                      ///< with the derivatives that the rows needed

  // What is made when it is first asked for.
  std::vector<std::unique_ptr<SizeEquations>> sizes;  ///< the last ones first
  std::optional<StartLevels> levels;
  std::vector<Entry> top;  ///< of top_jacobian()
  std::optional<Evaluator> top_slopes;
};
using StartEquationsPtr = std::shared_ptr<StartEquations>;

class StartSystem {
 public:
  /// Throws Error naming parameters, inputs and symbols without value. Keeps references to its arguments.
  StartSystem(const ModelPtr& model, const StartRequest& request);

  ModelPtr low;
  const Model& model;
  const StartRequest request;              ///< its guesses in unknowns of the model
  std::unordered_map<Expr, double> known;  ///< parameters, t

 private:
  StartEquationsPtr equations_;

 public:
  const std::vector<Expr>&unknowns, &rows;
  const std::size_t state_count, first_fix;
  Vec unit, row_unit;  ///< s, σ

  /// Of a row: "(3)′", "equation (3)", "x = 3".
  std::string label(std::size_t row) const;
  /// A row with the number that is fixed, for messages.
  Expr equation(std::size_t row) const;
  std::size_t fixes() const { return rows.size() - first_fix; }
  std::optional<Eigen::Index> position(Expr leaf) const;
  /// The unknown that fix k (guess k) is about; nothing if it is an expression in several.
  std::optional<Eigen::Index> fixed_unknown(std::size_t k) const { return equations_->fixed_unknown[k]; }
  const std::vector<char>& guessed() const { return guessed_; }
  /// Leaves of the rows that are no unknowns, t, parameters and fixed values, and their values.
  const std::vector<Expr>& given() const { return equations_->given; }
  const std::vector<double>& given_values() const { return given_; }
  /// Unknowns with a value of their own in fix.
  std::vector<char> fixed() const;

  /// r_i / σ_i. May contain NaN.
  Vec residual(const Vec& w) const;
  /// Bounds of the rounding errors of residual().
  Vec rounding_errors(const Vec& w) const;
  /// ∂(r_i/σ_i)/∂(w_j/s_j).
  Eigen::SparseMatrix<double> jacobian(const Vec& w) const;
  std::unordered_map<Expr, double> point(const Vec& w) const;
  /// The rows themselves, without units.
  std::vector<double> values(const Vec& w) const { return (*equations_->values)(leaf_values(w)); }
  bool has_signs() const { return equations_->has_signs; }
  /// ∂F/∂(top derivatives, algebraic variables) of the equations of index 1, scaled;
  /// 0 where it is cancellation.
  Mat top_jacobian(const Vec& w) const;

 private:
  friend const StartLevels& levels_of(const StartSystem& s);
  std::vector<double> leaf_values(const Vec& w) const;
  Magnitudes measure() const;

  std::vector<double> given_;  ///< values
  std::vector<char> guessed_;
};

/// Which rows take part, and which unknowns are held where they are; empty: all, none.
struct Selection {
  std::vector<char> rows, held;
};

const StartLevels& levels_of(const StartSystem& s);

struct StartSolution {
  Vec w;
  Vec residual;  ///< |r_i| relative to the size of the row's own terms
  bool solved = false;
  bool defined = true;  ///< false: an equation has no finite value (or slope) at the first point
  std::optional<std::size_t>
      stuck;          ///< a row not satisfied whose gradient is 0 at the first point (large systems)
  bool slow = false;  ///< steps shrank by half only: the equations lose rank at the solution, a double root
};

/// Damped Gauss-Newton with least steps in the units of the system: stays near the first point where the
/// equations leave freedom. Cost: per step one orthogonal decomposition, above `dense_up_to` unknowns a
/// sparse LDLᵀ of the regularised normal equations in augmented form.
StartSolution gauss_newton(const StartSystem& s, Vec w, const Selection& selection = {});
constexpr double allowed_errors =
    16;  ///< bounds of rounding errors that the residuals of a solution may have

/// The unknown of a solution that rounding errors of the residuals change most, if by more than a hundredth
/// of it. Nothing above `dense_up_to` unknowns. Cost: one orthogonal decomposition.
std::optional<LostDigits> lost_digits(const StartSystem& s, const Vec& w);
/// Where steps shrank by half only: the unknowns along the null vector of the Jacobian. Cost: one SVD.
std::optional<LostDigits> digits_at_double_root(const StartSystem& s, const Vec& w);

/// Gauss-Newton from the guess, then from spread points near it (symmetric points are often singular), with
/// the opposite signs, and further away.
StartSolution solve_start(const StartSystem& s, const Selection& selection = {});
constexpr int start_attempts = 5;  ///< starting points of solve_start(): the rows of `spread` there
/// New part of a unit row above which it is independent of others: far above rounding, `dense_up_to` ε =
/// 6e-14, and below the differences of coefficients that were typed.
constexpr double independent_row = 1e-9;
/// Numbers that were typed or printed have at least nine digits: equations that given values violate by less,
/// relative to their terms, hold. (With 1e-10 tests/dae/start_rounding_test.lua fails.)
constexpr double typed_accuracy = 1e-9;
/// Where the guess leads nowhere: with a guess for one more unknown after the other. Small models only, and
/// not where intervals prove that there is no solution.
StartSolution solve_with_more_guesses(const ModelPtr& model, const StartSystem& s);
/// Where the equations to be solved are of form "array": from derivatives that are found order by order.
StartSolution solve_by_orders(const ModelPtr& model, const StartSystem& s);
/// Values that are fixed, unless their row is not selected, are as given; guesses too at the first attempt.
Vec first_point(const StartSystem& s, int attempt, const Selection& selection = {}, bool keep_guess = false);

/// Values that a start leaves free, from the Jacobian at it.
struct Freedom {
  std::vector<char> redundant;     ///< by fix: determined by the equations and the fixes before it
  int rank_equations = 0;          ///< of the rows that are no fixes
  Mat undetermined;                ///< by equations, fixes and guesses: a basis in units, small systems only
  std::vector<Eigen::Index> open;  ///< unknowns that can move (of which to choose)
  std::vector<Eigen::Index> recommended;  ///< a choice of them that determines everything
  std::vector<char> chosen;               ///< by unknown: free, and covered by a guess
  int count = 0;                          ///< how many initial values are still to be chosen
  int dimension = 0;      ///< of the solutions of the equations near the point: how many values are free
  bool is_bound = false;  ///< only an upper bound of it is known, and of the fixes that are not redundant
};
/// `slow`: the point is known to half of the digits only, and so is the rank.
Freedom freedom(const StartSystem& s, const Vec& w, bool slow = false);
/// Where the Jacobian loses rank, by equations or fixes: what second derivatives tell of the solutions
/// nearby. docs/derivations.md#start. Cost: two Jacobians for each direction of a null space.
void refine_by_curvature(const StartSystem& s, const Vec& w, double threshold, Freedom& f);
/// The same by sparse elimination, for large systems; without `undetermined`.
Freedom sparse_freedom(const StartSystem& s, const Eigen::SparseMatrix<double>& J);

/// The model with every factor of its equations once, at values of its parameters; nothing if none is
/// repeated.
ModelPtr without_repeated_factors(const ModelPtr& model, const ParameterValues& parameters);

/// Errors. What each says: start_errors.cpp, start_conflict.cpp.
[[noreturn]] void explain_undefined(const ModelPtr& model, const StartSystem& s);
/// "x′ = 1": values at a start where equations divide by 0, if the solution continues smoothly through it. Of
/// small models that algebra can free of their denominators; else "".
std::string smooth_values(const ModelPtr& model, const StartRequest& request);
[[noreturn]] void explain_stuck(const StartSystem& s, std::size_t row);
[[noreturn]] void explain_conflict(const StartSystem& s, const StartSolution& failed);
[[noreturn]] void explain_freedom(const ModelPtr& model, const StartSystem& s, const Vec& w,
                                  const Freedom& open);

/// A start in the active region of a piecewise model whose regions differ in index; nullptr for other models.
/// throws    Error that says for every region why it has no consistent start
ConsistentStatePtr start_in_region(const ModelPtr& model, const StartRequest& request);

/// Where arguments of sign are 0 at a start that takes sign(0) = 0: the start at which they are 1, -1, or
/// what keeps the argument 0; nullptr where there is nothing to decide, or no such start.
ConsistentStatePtr start_on_signs(const ModelPtr& model, const StartRequest& request,
                                  const ConsistentState& plain);

/// Throws Error where the equations of index 1 do not determine x′ and z at this point, with what vanishes
/// there and the values of a solution that continues smoothly, if there is one; where the values are not all
/// determined yet (`is_determined`), only if there is one. Small models only.
void require_regular_point(const ModelPtr& model, const StartSystem& s, const Vec& w, bool is_determined);

/// The factors that vanish at a point where the equations do not determine x′ and z, and the continuations:
/// the end of a sentence such as "The equations are singular here". "" where neither is known.
struct Crossing {
  std::string factors;        ///< "z = 0"
  std::string continuations;  ///< "z′ = -1 or z′ = 1"
  std::string choices;        ///< "{ [z.dot] = -1 } or { [z.dot] = 1 }"
};
Crossing crossing_at(const ModelPtr& model, const StartSystem& s, const Vec& w);

/// A sentence for a mechanism in which only multipliers are undetermined: its constraints depend on each
/// other.
std::string redundancy_hint(const ModelPtr& model, const std::vector<Expr>& open);

/// The contradictory fixes moved onto the constraints: min Σ ((w_j - fix_j)/s_j)² subject to the equations.
/// Throws Failure where no stationary point was found.
StartSolution nearest_start(const StartSystem& s);

std::vector<Expr> unknowns_in(const StartSystem& s, Expr e);
/// "x = 3, y = 0.5"
std::string values_of(const std::vector<Expr>& list, const std::unordered_map<Expr, double>& point);
/// How a leaf is written as a key of fix and guess: "x = ", "[q[3].dot] = ".
std::string key_text(Expr leaf);
/// "sys:init{ fix = { x = 0.6, [x.dot] = 0 } }".
std::string call_text(const LeafValues& fix, const LeafValues& guess = {});

/// Σ |∂e/∂y y| over the leaves of e that have a value: what its rounding errors are measured by.
double size_of_terms(Expr e, const std::unordered_map<Expr, double>& point);

}  // namespace pendula::dae
