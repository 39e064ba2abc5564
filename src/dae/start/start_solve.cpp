#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/interrupt.hpp"
#include "dae/model/lineage.hpp"
#include "dae/newton/block_solution.hpp"
#include "dae/newton/lifted_newton.hpp"
#include "dae/points/interval_proof.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/array_point.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double solved_below = 1e-10;  // scaled residual that counts as satisfied
constexpr double unit_roundoff = std::numeric_limits<double>::epsilon() / 2;
constexpr int max_iterations = 60;  // a double root takes 26: half the distance each, down to √ε
// of a full step, or relative to the point; with shorter steps the iteration has stalled (the
// tests of starts pass from 1e-5 to 1e-3)
constexpr double shortest_step = 1e-4;
constexpr double polishing_step = 0.75;  // at a solution; a full step that does not improve it is rounding
constexpr double sufficient = 0.1;       // share of the predicted decrease that a step must bring
constexpr double rounding_step =
    1e-15;  // relative to the value of every unknown, since a unit may be far too large
// At a double root every step halves the distance. Only steps above `visible` count; six
// in succession suffice. (The tests of starts pass with `visible` from 1e-8 to 1e-6.)
constexpr double visible = 1e-7, half_low = 0.4, half_high = 0.6;
constexpr int double_root_after = 6;

/// Residual and Jacobian of the selected rows, in the unknowns that are free to move.
class Selected {
 public:
  Selected(const StartSystem& s, const Selection& selection) : s_(s), selection_(selection) {}

  Vec residual(const Vec& w) const {
    Vec r = s_.residual(w);
    for (Index i = 0; i < r.size(); ++i)
      if (!row(i)) r[i] = 0;
    return r;
  }

  Sparse jacobian(const Vec& w) const {
    Sparse J = s_.jacobian(w);
    if (selection_.rows.empty() && selection_.held.empty()) return J;
    J.prune([&](Index i, Index j, double) { return row(i) && moves(j); });
    return J;
  }

 private:
  bool row(Index i) const { return selection_.rows.empty() || selection_.rows[i]; }
  bool moves(Index j) const { return selection_.held.empty() || !selection_.held[j]; }
  const StartSystem& s_;
  const Selection& selection_;
};

/// |r_i| / (1 + Σ_j |J_ij ω_j|), where 1 is the unit of the row.
Vec relative(const Vec& r, const Sparse& J, const Vec& omega) {
  return r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * omega.cwiseAbs());
}

/// The largest residual relative to its rounding errors: those of the evaluation at w and of the digits of w
/// itself, and those of `zero` units, the scale for values of 0.
double excess(const StartSystem& s, const Selected& system, const Vec& w, double zero) {
  const Vec r = system.residual(w);
  const Sparse J = system.jacobian(w);
  if (r.size() == 0) return 0;
  if (!r.allFinite() || !all_finite(J)) return INFINITY;
  const Vec terms = J.cwiseAbs() * w.cwiseQuotient(s.unit).cwiseAbs();
  const Vec error = s.rounding_errors(w) + unit_roundoff * (terms + Vec::Constant(r.size(), zero));
  return r.cwiseAbs()
      .binaryExpr(error, [](double residual, double bound) { return residual == 0 ? 0 : residual / bound; })
      .maxCoeff();
}

/// Is every residual at its rounding level? If not, takes steps as long as they halve the worst one. If that
/// fails, returns false and leaves w unchanged. In 5000 starts of the tests, residuals of solutions exceeded
/// these errors by factors of up to 6, others by 70 or more.
bool refine(const StartSystem& s, const Selected& system, Vec& w) {
  double before = INFINITY;
  for (Vec at = w;;) {
    const double now = excess(s, system, at, 1);
    if (now <= allowed_errors) {
      w = at;
      return true;
    }
    if (!(now <= before / 2)) return false;
    before = now;
    at += balanced_step(system.jacobian(at), system.residual(at)).cwiseProduct(s.unit);
  }
}

/// Step weights: unknowns without a guess move a thousand times more readily than guessed states; guessed
/// algebraic variables and derivatives, which follow from the states, thirty times.
Vec reaches(const StartSystem& s) {
  constexpr double ready = 1e3, follows = 30;  // the tests of starts pass from a tenth to ten times these
  const auto& guessed = s.guessed();
  const bool any = std::find(guessed.begin(), guessed.end(), 1) != guessed.end();
  Vec reach = Vec::Constant(static_cast<Index>(guessed.size()), any ? ready : 1);
  for (std::size_t j = 0; j < guessed.size(); ++j)
    if (guessed[j]) reach[j] = j < s.state_count ? 1 : follows;
  return reach;
}

}  // namespace

/// Damped Gauss-Newton until no step improves the point.
static StartSolution descend(const StartSystem& s, const Selected& system, Vec w) {
  const Vec reach = reaches(s);
  StartSolution out;
  out.w = w;
  out.residual = Vec::Constant(static_cast<Index>(s.rows.size()), INFINITY);
  double last_step = 0;
  int halvings = 0;  // consecutive full steps that shrank by half: a double root
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_interrupt();
    const Vec r = system.residual(w);
    const Sparse J = system.jacobian(w);
    if (!r.allFinite() || !all_finite(J)) {
      out.defined = iteration > 0;
      break;
    }
    const Vec omega = w.cwiseQuotient(s.unit);
    out.w = w;
    out.residual = relative(r, J, omega);
    out.solved = out.residual.size() == 0 || out.residual.maxCoeff() < solved_below;
    if (r.norm() == 0) break;
    const Vec weight = row_weights(J);
    const Sparse weighted = weight.asDiagonal() * J * reach.asDiagonal();
    Vec step = reach.cwiseProduct(least_step(weighted, weight.cwiseProduct(r)));
    if (!step.allFinite()) break;
    const double size = weight.cwiseProduct(r).norm();
    // relative to each unknown itself, since units may be too small by many orders
    const double full = step.cwiseQuotient(Vec::Ones(w.size()) + omega.cwiseAbs()).cwiseAbs().maxCoeff();
    // from z = 0 to the solution 10³ of z³ + z = 10⁹ a full step is 10⁹
    const double shortest = out.solved ? polishing_step : shortest_step / std::max(1.0, full);
    double alpha = 1;
    Vec trial;
    const auto search = [&](const Vec& direction) {
      for (alpha = 1; alpha > shortest; alpha /= 2) {
        trial = w + alpha * direction.cwiseProduct(s.unit);
        const Vec next = weight.cwiseProduct(system.residual(trial));
        if (next.allFinite() && next.norm() <= (1 - sufficient * alpha) * size) break;
      }
    };
    search(step);
    // a row may resemble others and differ only in its small entries
    if (alpha <= shortest && !out.solved && J.cols() <= dense_up_to)
      if (const auto other = solve_by_blocks(Mat(J), Vec(-r))) search(step = *other);
    const double moved = alpha * step.norm(), far = 1 + omega.norm();
    if (moved > visible * far)
      halvings = moved > half_low * last_step && moved < half_high * last_step ? halvings + 1 : 0;
    out.slow = halvings >= double_root_after;
    last_step = moved;
    const bool rounded = ((trial - w).cwiseAbs().array() <= rounding_step * w.cwiseAbs().array()).all();
    if (alpha <= shortest || rounded) break;
    w = trial;
  }
  return out;
}

/// Fixed values that are determined by others may deviate by the digits that they were typed with, and are
/// moved onto the equations.
static bool settle(const StartSystem& s, const Selection& selection, Vec& w) {
  if (refine(s, Selected(s, selection), w)) return true;
  Selection equations = selection;
  if (equations.rows.empty()) equations.rows.assign(s.rows.size(), 1);
  std::fill(equations.rows.begin() + static_cast<std::ptrdiff_t>(s.first_fix), equations.rows.end(), 0);
  Vec moved = w;
  if (!refine(s, Selected(s, equations), moved)) return false;
  const Selected system(s, selection);
  const Vec residual = relative(system.residual(moved), system.jacobian(moved), moved.cwiseQuotient(s.unit));
  if (!(residual.maxCoeff() < typed_accuracy)) return false;
  w = moved;
  return true;
}

StartSolution gauss_newton(const StartSystem& s, Vec w, const Selection& selection) {
  constexpr double near =
      1e-7;  // half of the digits: with numbers of very different sizes minimal steps may stall there
  StartSolution out = descend(s, Selected(s, selection), std::move(w));
  if (out.defined && (out.residual.size() == 0 || out.residual.maxCoeff() < near))
    out.solved = settle(s, selection, out.w);
  return out;
}

Vec first_point(const StartSystem& s, int attempt, const Selection& selection, bool keep_guess) {
  constexpr double spread[start_attempts] = {0, 0.1, 0.1, 1, 3};  // in units, around the guess
  constexpr int mirrored = 2;
  Vec w(static_cast<Index>(s.unknowns.size())), shift(w.size());
  for (Index j = 0; j < w.size(); ++j) {
    const double fraction = std::fmod((static_cast<double>(j) + 1) * golden_fraction, 1.0);
    w[j] = shift[j] = s.unit[j] * spread[attempt] * (attempt <= mirrored ? fraction : 2 * fraction - 1);
  }
  // random variation does not help a large model far from its guess
  const bool small = w.size() <= dense_up_to;
  for (const auto& [leaf, value] : s.request.guess)
    if (const auto j = s.position(resolve(s.model, leaf)))
      w[*j] = !small || keep_guess ? value : attempt == mirrored ? -value : value + shift[*j];
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.position(resolve(s.model, s.request.fix[k].first))) {
      const bool dropped = !selection.rows.empty() && !selection.rows[s.first_fix + k];
      w[*j] = s.request.fix[k].second + (dropped && small ? shift[*j] : 0);
    }
  return w;
}

const StartLevels& levels_of(const StartSystem& s) {
  auto& known = s.equations_->levels;
  if (known) return *known;
  StartLevels& levels = known.emplace();
  const auto& invariants = s.low->invariants;
  if (s.request.keep_invariants)
    for (const Constraint& c : invariants) levels.of_row.push_back(c.derivative);
  for (int level : levels.of_row) levels.highest = std::max(levels.highest, level);
  levels.of_row.resize(s.first_fix, levels.highest + 1);
  levels.of_unknown.assign(s.unknowns.size(), levels.highest + 1);
  for (std::size_t i = 0; i < s.first_fix; ++i)
    for (Expr leaf : leaves({&s.rows[i], 1}))
      if (const auto j = s.position(leaf))
        levels.of_unknown[*j] = std::min(levels.of_unknown[*j], levels.of_row[i]);
  return levels;
}

/// The rows of all levels up to this one; or of this level alone, with the unknowns of lower levels held.
static Selection part_of(const StartSystem& s, const StartLevels& levels, int level, Selection part,
                         bool alone) {
  if (part.rows.empty()) part.rows.assign(s.rows.size(), 1);
  for (std::size_t i = 0; i < s.first_fix; ++i)
    if (levels.of_row[i] > level || (alone && levels.of_row[i] < level)) part.rows[i] = 0;
  if (!alone) return part;
  if (part.held.empty()) part.held.assign(s.unknowns.size(), 0);
  for (std::size_t j = 0; j < s.unknowns.size(); ++j)
    if (levels.of_unknown[j] < level) part.held[j] = 1;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k); j && levels.of_unknown[*j] < level) part.rows[s.first_fix + k] = 0;
  return part;
}

/// Solves large systems, and conditions of high order, level by level: first the conditions on positions,
/// then those on velocities …, finally all. Far from a solution, accelerations and multipliers would
/// disturb the iteration.
static StartSolution by_levels(const StartSystem& s, Vec w, const Selection& selection) {
  const StartLevels& levels = levels_of(s);
  const bool high = levels.highest >= StartLevels::high;
  if ((w.size() > dense_up_to || high) && s.request.keep_invariants) {
    for (int level = 0; level <= levels.highest; ++level) {
      StartSolution next =
          high ? gauss_newton(s, w, part_of(s, levels, level, selection, true)) : StartSolution{};
      if (!next.solved) next = gauss_newton(s, w, part_of(s, levels, level, selection, false));
      if (!next.solved) break;
      w = next.w;
    }
    // accelerations and multipliers at the present states
    Selection rest = high ? part_of(s, levels, levels.highest + 1, selection, true) : selection;
    if (rest.held.empty()) rest.held.assign(s.unknowns.size(), 0);
    std::fill_n(rest.held.begin(), s.state_count, 1);
    if (const StartSolution next = gauss_newton(s, w, rest); next.solved) w = next.w;
  }
  return gauss_newton(s, std::move(w), selection);
}

/// An unsatisfied row that no unknown changes to first order, so that Gauss-Newton cannot reduce it.
static std::optional<std::size_t> stuck_row(const StartSystem& s, const Vec& w, const Selection& selection) {
  const Selected system(s, selection);
  const Vec r = system.residual(w);
  const Sparse J = system.jacobian(w);
  if (!r.allFinite() || !all_finite(J)) return {};
  // in units: a step that removes the residual is 10⁶ units long
  constexpr double violated = 1e-6, flat = 1e-12;
  Vec largest = Vec::Zero(J.rows());
  for (Index j = 0; j < J.outerSize(); ++j)
    for (Sparse::InnerIterator it(J, j); it; ++it)
      largest[it.row()] = std::max(largest[it.row()], std::fabs(it.value()));
  for (Index i = 0; i < r.size(); ++i)
    if (std::fabs(r[i]) > violated && largest[i] < flat) return static_cast<std::size_t>(i);
  return {};
}

namespace {

/// One attempt at a solution.
struct Attempt {
  Selection selection;
  int point;  ///< argument of first_point()
  enum class Accept { exact, simple_root, solved } accept;
  bool reported;  ///< whether its failure may be shown to the user
};

bool accepted(const StartSystem& s, const Attempt& attempt, const StartSolution& found) {
  if (!found.solved) return false;
  if (attempt.accept == Attempt::Accept::exact)
    return excess(s, Selected(s, attempt.selection), found.w, 0) <= allowed_errors;
  return attempt.accept == Attempt::Accept::solved || !found.slow;
}

/// In this order:
///   1. all guesses held: guesses that satisfy the equations stay exactly as they are;
///   2. guessed states held (small models), so that unknowns that follow from them do not move them;
///   3. from every first point: fixed values held, then fixed values free to move.
std::vector<Attempt> attempts_for(const StartSystem& s, const Selection& selection) {
  std::vector<Attempt> list;
  const bool small = s.unknowns.size() <= static_cast<std::size_t>(dense_up_to);
  Selection held = selection;
  if (held.held.empty()) held.held = s.fixed();
  for (std::size_t k = 0; k < s.fixes() && !selection.rows.empty(); ++k)
    if (const auto j = s.fixed_unknown(k); j && !selection.rows[s.first_fix + k]) held.held[*j] = 0;
  if (selection.held.empty() && selection.rows.empty() && !s.request.guess.empty()) {
    Selection here = held;
    const auto& guessed = s.guessed();
    for (std::size_t j = 0; j < guessed.size(); ++j) here.held[j] = here.held[j] || guessed[j];
    list.push_back({here, 0, Attempt::Accept::exact, false});
    for (std::size_t j = s.state_count; j < guessed.size(); ++j) here.held[j] = held.held[j];
    if (small) list.push_back({here, 0, Attempt::Accept::simple_root, false});
  }
  const bool nothing_held = selection.held.empty() && std::count(held.held.begin(), held.held.end(), 1) == 0;
  for (int point = 0; point < (small ? start_attempts : 2); ++point) {
    list.push_back({held, point, Attempt::Accept::solved, nothing_held});
    if (!nothing_held) list.push_back({selection, point, Attempt::Accept::solved, true});
  }
  return list;
}

}  // namespace

/// Solves with the exponents of the equations as additional unknowns, from the guess.
static StartSolution with_lifted_exponents(const StartSystem& s, const Selection& selection) {
  std::vector<Expr> rows, unknowns, given = s.given();
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    if (selection.rows.empty() || selection.rows[i]) rows.push_back(s.rows[i]);
  Vec w = first_point(s, 0, selection);
  std::vector<double> values = s.given_values(), from, units;
  std::vector<Index> place;
  for (std::size_t j = 0; j < s.unknowns.size(); ++j) {
    const auto k = static_cast<Index>(j);
    const bool held = !selection.held.empty() && selection.held[j];
    (held ? given : unknowns).push_back(s.unknowns[j]);
    (held ? values : from).push_back(w[k]);
    if (held) continue;
    place.push_back(k);
    units.push_back(s.unit[k]);
  }
  const LiftedNewton lifted(rows, unknowns, given);
  if (!lifted.applies()) return {};
  const auto moving = static_cast<Index>(from.size());
  const auto found =
      lifted(Eigen::Map<const Vec>(from.data(), moving), values, Eigen::Map<const Vec>(units.data(), moving));
  if (!found) return {};
  w(place) = *found;
  return gauss_newton(s, std::move(w), selection);
}

StartSolution solve_start(const StartSystem& s, const Selection& selection) {
  StartSolution best;
  bool defined = false;  // at some first point
  for (const Attempt& attempt : attempts_for(s, selection)) {
    // a guess at which the equations are undefined must be reported
    const Vec from = first_point(s, attempt.point, selection, attempt.point > 0 && !defined);
    StartSolution next = by_levels(s, from, attempt.selection);
    if (accepted(s, attempt, next)) return next;
    // states with a guess must not move because of exponentials, if a start follows from them
    if (attempt.accept == Attempt::Accept::simple_root) next = with_lifted_exponents(s, attempt.selection);
    if (accepted(s, attempt, next)) return next;
    if (!attempt.reported) continue;
    defined = defined || next.defined;
    if (attempt.point == 0 || next.residual.maxCoeff() < best.residual.maxCoeff()) best = std::move(next);
    if (from.size() > dense_up_to && (best.stuck = stuck_row(s, from, selection))) break;
  }
  best.defined = defined;
  if (StartSolution found = with_lifted_exponents(s, selection); found.solved) return found;
  return best;
}

/// Do intervals prove that the rows have no solution at the fixed values?
static bool is_impossible(const StartSystem& s) {
  auto known = s.known;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k)) known[s.unknowns[*j]] = s.request.fix[k].second;
  return has_no_solution({s.rows.data(), s.first_fix}, known);
}

StartSolution solve_by_orders(const ModelPtr& model, const StartSystem& s) {
  if (s.low->form != "array") return {};
  auto near = s.known;
  for (const auto& list : {s.request.guess, s.request.fix})
    for (const auto& [leaf, value] : list) near[original_leaf(s.model, leaf)] = value;
  StartRequest request = s.request;
  for (const auto& [leaf, value] : derivatives_near(s.low, near)) request.guess.emplace_back(leaf, value);
  if (request.guess.size() == s.request.guess.size()) return {};
  return solve_start(StartSystem(model, request));
}

StartSolution solve_with_more_guesses(const ModelPtr& model, const StartSystem& s) {
  constexpr std::size_t most_unknowns = 60;
  constexpr int most_points = 48;  // a Gauss-Newton run each; eight unknowns with all sizes
  constexpr double sizes[] = {1, -1, 3, -3, 0.3, -0.3};  // in units
  if (s.unknowns.size() > most_unknowns || is_impossible(s)) return {};
  const std::vector<char> fixed = s.fixed(), guessed = s.guessed();
  std::vector<Index> open;
  for (std::size_t j = 0; j < s.unknowns.size(); ++j)
    if (!fixed[j] && !guessed[j]) open.push_back(static_cast<Index>(j));
  int points = 0;
  for (double size : sizes)
    for (Index j : open) {
      if (++points > most_points) return {};
      StartRequest request = s.request;
      request.guess.emplace_back(s.unknowns[j], size * s.unit[j]);
      const StartSystem near(model, request);
      StartSolution found = gauss_newton(near, first_point(near, 0), {{}, fixed});
      if (found.solved) return found;
    }
  return {};
}

}  // namespace pendula::dae
