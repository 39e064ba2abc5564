// Fixed values without a start: a minimal set of conflicting ones, a proof of the conflict, and
// the error message.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/points/interval_proof.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double satisfied = 1e-8;  // 100 times the residuals of solutions (solved_below in start_solve.cpp)

bool takes_part(double residual) { return residual > satisfied; }

/// Solves rows for unknowns that are not fixed, as long as they are linear in them and `may_divide` accepts
/// the slope, and substitutes the solutions.
template <class Fixed, class MayDivide>
std::vector<Expr> eliminated(const StartSystem& s, std::vector<Expr> rows, const Fixed& is_fixed,
                             const MayDivide& may_divide) {
  for (bool again = true; again;) {
    again = false;
    for (std::size_t i = 0; i < rows.size() && !again; ++i)
      for (Expr leaf : unknowns_in(s, rows[i])) {
        if (is_fixed(leaf)) continue;
        const Expr slope = simplify(partial(rows[i], leaf));
        if (slope.is_zero() || depends_on(slope, leaf)) continue;
        if (!may_divide(rows, slope)) continue;
        const Expr solution = -substitute(rows[i], {{leaf, Expr(0)}}) / slope;
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(i));
        for (Expr& other : rows) other = tidied(substitute(other, {{leaf, solution}}));
        again = true;
        break;
      }
  }
  return rows;
}

/// The remaining conditions, on the fixed values alone.
std::vector<Expr> conditions_on_fixed(const StartSystem& s, std::vector<Expr> rows,
                                      const std::vector<Expr>& fixed,
                                      const std::unordered_map<Expr, double>& point) {
  const auto is_fixed = [&](Expr leaf) { return std::find(fixed.begin(), fixed.end(), leaf) != fixed.end(); };
  rows = eliminated(s, std::move(rows), is_fixed, [&](const std::vector<Expr>&, Expr slope) {
    const double value = pendula::evaluate({&slope, 1}, point)[0];
    constexpr double divisor = 1e-9;  // the tests of starts pass from a tenth to ten times this
    return std::isfinite(value) && std::fabs(value) >= divisor;
  });
  std::erase_if(rows, [&](Expr e) {
    const auto inside = unknowns_in(s, e);
    return !is_short(e, 200) || !std::all_of(inside.begin(), inside.end(), is_fixed);
  });
  return rows;
}

struct Conflict {
  std::vector<std::size_t> fixes, equations;  ///< rows of the system
};

/// Is it proved that these equations hold nowhere at these fixed values? By intervals, before and after
/// elimination of unknowns. Typed numbers are exact; others have rounding errors.
bool is_proved(const StartSystem& s, const Conflict& conflict) {
  constexpr std::size_t most_eliminated = 20;  // rows: their expressions grow with each
  std::vector<Expr> rows;
  std::unordered_map<Expr, double> known;
  Substitution exact;
  const auto give = [&](Expr leaf, double value) {
    if (exact_value(Expr(value)))
      exact[leaf] = Expr(value);
    else
      known[leaf] = value;
  };
  for (const auto& [leaf, value] : s.known) give(leaf, value);
  for (std::size_t i : conflict.equations) rows.push_back(s.rows[i]);
  for (std::size_t i : conflict.fixes) {
    const std::size_t k = i - s.first_fix;
    const auto j = s.fixed_unknown(k);
    if (j && !exact.count(s.unknowns[*j]) && !known.count(s.unknowns[*j]))
      give(s.unknowns[*j], s.request.fix[k].second);
    else
      rows.push_back(s.equation(i));
  }
  for (Expr& row : rows) row = tidied(substitute(row, exact));
  if (has_no_solution(rows, known)) return true;
  if (rows.size() > most_eliminated) return false;
  const auto is_never_zero = [&](std::vector<Expr> equations, Expr slope) {
    equations.push_back(slope);
    return has_no_solution(equations, known);
  };
  const auto is_fixed = [&](Expr leaf) { return known.count(leaf) > 0; };
  return has_no_solution(eliminated(s, rows, is_fixed, is_never_zero), known);
}

/// A conflict with a proof, reduced to the necessary fixes and equations; empty if there is no proof.
std::optional<Conflict> proved_conflict(const StartSystem& s) {
  constexpr std::size_t most_rows = 200;  // a proof is tried without each of them
  Conflict conflict;
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    (i < s.first_fix ? conflict.equations : conflict.fixes).push_back(i);
  if (s.rows.size() > most_rows || !is_proved(s, conflict)) return {};
  for (auto* list : {&conflict.fixes, &conflict.equations})
    for (std::size_t k = list->size(); k-- > 0;) {
      const std::size_t row = (*list)[k];
      list->erase(list->begin() + static_cast<std::ptrdiff_t>(k));
      if (!is_proved(s, conflict)) list->insert(list->begin() + static_cast<std::ptrdiff_t>(k), row);
    }
  return conflict;
}

/// The shortest equation with all unknowns fixed that the given values violate; empty if there is none.
std::optional<Conflict> conflict_in_one_equation(const StartSystem& s) {
  std::unordered_map<Expr, std::size_t> fixed;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k)) fixed[s.unknowns[*j]] = s.first_fix + k;
  std::optional<Conflict> best;
  for (std::size_t i = 0; i < s.first_fix; ++i) {
    const auto inside = unknowns_in(s, s.rows[i]);
    Conflict here{{}, {i}};
    for (Expr leaf : inside)
      if (const auto it = fixed.find(leaf); it != fixed.end()) here.fixes.push_back(it->second);
    if (here.fixes.size() < inside.size() || (best && best->fixes.size() <= here.fixes.size())) continue;
    if (!is_proved(s, here)) continue;
    std::sort(here.fixes.begin(), here.fixes.end());
    best = std::move(here);
  }
  return best;
}

/// Drops every fix that is unnecessary for the contradiction; then keeps the rows with a remaining residual.
Conflict smallest_conflict(const StartSystem& s, const StartSolution& failed) {
  constexpr std::size_t most_trials = 40;  // starts to be solved, in each of three passes
  Selection selection{std::vector<char>(s.rows.size(), 1), {}};
  std::vector<std::size_t> candidates;
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) candidates.push_back(i);
  if (candidates.size() > most_trials)  // fixes with zero least-squares residuals do not conflict
    std::erase_if(candidates, [&](std::size_t i) {
      const bool quiet = !takes_part(failed.residual[i]);
      if (quiet) selection.rows[i] = 0;
      return quiet;
    });
  if (!selection.rows.empty() && solve_start(s, selection).solved) selection.rows.assign(s.rows.size(), 1);
  if (candidates.size() > most_trials) candidates.resize(most_trials);
  const auto filtered = [&](Selection trial) {
    for (std::size_t i : candidates) {
      trial.rows[i] = 0;
      if (solve_start(s, trial).solved) trial.rows[i] = 1;  // needed for the contradiction
    }
    return trial;
  };
  const auto size = [](const Selection& trial) {
    return std::count(trial.rows.begin(), trial.rows.end(), 1);
  };
  const Selection forward = filtered(selection);
  std::reverse(candidates.begin(), candidates.end());
  selection = filtered(selection);
  if (size(forward) < size(selection)) selection = forward;
  const StartSolution least = solve_start(s, selection);
  Conflict conflict;
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i)
    if (selection.rows[i]) conflict.fixes.push_back(i);
  for (std::size_t i = 0; i < s.first_fix; ++i)
    if (takes_part(least.residual[i])) conflict.equations.push_back(i);
  if (conflict.equations.size() > most_trials) return conflict;
  const auto all = conflict.equations;
  for (auto i = all.rbegin(); i != all.rend(); ++i) {  // the user's own fixes are dropped last
    selection.rows[*i] = 0;
    if (solve_start(s, selection).solved)
      selection.rows[*i] = 1;
    else
      std::erase(conflict.equations, *i);
  }
  return conflict;
}

/// The equations at the fixed values, with the other unknowns as close to a solution as possible.
std::unordered_map<Expr, double> nearest_miss(const StartSystem& s, const Conflict& conflict) {
  Selection selection{std::vector<char>(s.rows.size(), 1), std::vector<char>(s.unknowns.size(), 0)};
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) selection.rows[i] = 0;
  Vec w = first_point(s, 0);
  for (std::size_t i : conflict.fixes) {
    const std::size_t k = i - s.first_fix;
    if (const auto j = s.fixed_unknown(k)) {
      w[*j] = s.request.fix[k].second;
      selection.held[*j] = 1;
    }
  }
  w = gauss_newton(s, w, selection).w;
  const auto size = [&] { return s.residual(w).head(static_cast<Index>(s.first_fix)).norm(); };
  constexpr double small = 0.01, as_low = 1.001;                     // of the unit; of the residual
  for (Index j = 0; j < w.size() && w.size() <= dense_up_to; ++j) {  // minima are flat; prefer 0 to 1e-4
    if (selection.held[j] || std::fabs(w[j]) > small * s.unit[j]) continue;
    const double before = size(), old = std::exchange(w[j], 0);
    if (!(size() <= before * as_low)) w[j] = old;
  }
  return s.point(w);
}

std::string short_label(const StartSystem& s, std::size_t row) {
  constexpr std::string_view word = "equation ";
  const std::string label = s.label(row);
  return label.starts_with(word) ? label.substr(word.size()) : label;
}

/// Equations of a conflict with all unknowns fixed by these rows and violated by the given values.
std::vector<std::string> violations_of_given_values(const StartSystem& s, const Conflict& conflict,
                                                    const std::vector<std::size_t>& fixes) {
  Vec w = first_point(s, 0);
  std::unordered_set<Expr> fixed;
  for (std::size_t i : fixes)
    if (const auto j = s.fixed_unknown(i - s.first_fix)) {
      w[*j] = s.request.fix[i - s.first_fix].second;
      fixed.insert(s.unknowns[*j]);
    }
  const auto point = s.point(w);
  std::vector<std::string> lines;
  for (std::size_t i : conflict.equations) {
    const Expr e = s.rows[i];
    const auto inside = unknowns_in(s, e);
    if (!std::all_of(inside.begin(), inside.end(), [&](Expr leaf) { return fixed.count(leaf) > 0; }))
      continue;
    const double value = pendula::evaluate({&e, 1}, point)[0];
    if (std::fabs(value) > typed_accuracy * std::max(1.0, size_of_terms(e, point)))
      lines.push_back(text(short_label(s, i), ":  0 ≠ ", rounded(value, 6), " = ", truncated_text(e), "  at ",
                           values_of(inside, point)));
  }
  return lines;
}

std::vector<std::string> violations(const StartSystem& s, const Conflict& conflict) {
  const auto point = nearest_miss(s, conflict);
  std::vector<Expr> equations, fixed;
  std::vector<std::string> labels, lines;
  for (std::size_t i : conflict.equations) {
    equations.push_back(s.rows[i]);
    labels.push_back(short_label(s, i));
  }
  for (std::size_t i : conflict.fixes)
    if (const auto j = s.fixed_unknown(i - s.first_fix)) fixed.push_back(s.unknowns[*j]);
  const auto value = [&](Expr e) { return pendula::evaluate({&e, 1}, point)[0]; };
  constexpr double digits = 1e-12;     // 4500 ε of the terms: the rest of an elimination
  constexpr std::size_t readable = 8;  // equations
  const auto rounding = [&](Expr e) { return digits * std::min(1.0, size_of_terms(e, point)); };
  if (equations.size() <= readable)
    for (Expr e : conditions_on_fixed(s, equations, fixed, point))
      if (std::isfinite(value(e)) && std::fabs(value(e)) > rounding(e))
        lines.push_back(
            text(join(labels, ", "), ":  0 ≠ ", rounded(value(e), 6), " = ", truncated_text(tidied(e))));
  if (lines.empty()) lines = violations_of_given_values(s, conflict, conflict.fixes);
  std::vector<std::size_t> every(s.fixes());
  std::iota(every.begin(), every.end(), s.first_fix);
  if (lines.empty()) lines = violations_of_given_values(s, conflict, every);
  if (!lines.empty()) return lines;
  for (std::size_t k = 0; k < equations.size() && k < readable; ++k)
    if (const double left = std::fabs(value(equations[k]));
        std::isfinite(left) && left > rounding(equations[k]))
      lines.push_back(text(labels[k], ":  0 ≠ ", rounded(value(equations[k]), 6), " = ",
                           truncated_text(equations[k]), "  at ",
                           values_of(unknowns_in(s, equations[k]), point)));
  return lines;
}

/// Reports fixes of unknowns whose values the equations determine as numbers.
std::vector<std::string> given_by_equations(const StartSystem& s, const Conflict& conflict) {
  std::vector<std::string> lines;
  for (std::size_t i : conflict.fixes) {
    if (!unknowns_in(s, s.rows[i]).empty()) continue;
    const auto& [leaf, value] = s.request.fix[i - s.first_fix];
    const Expr row = s.equation(i);
    const double excess = pendula::evaluate({&row, 1}, s.known)[0];
    lines.push_back(text("the equations give ", to_text(leaf), " = ", to_text(resolve(s.model, leaf)), " = ",
                         rounded(value + excess, 6)));
  }
  return lines;
}

/// "C{ v0 = false } or L{ i0 = false }": parts whose declared start values are in the conflict; empty if the
/// request contains some of these values.
std::string parts_to_release(const StartSystem& s, const Conflict& conflict) {
  std::vector<std::string> words;
  for (std::size_t i : conflict.fixes) {
    const Expr leaf = s.request.fix[i - s.first_fix].first;
    const auto& declared = s.model.start_values;
    const auto own = std::find_if(declared.begin(), declared.end(),
                                  [&](const auto& entry) { return entry.first == leaf; });
    if (own == declared.end() || !own->second.is_symbol()) return {};
    std::string name = symbol_of(own->second).name;
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) return {};
    std::string key = name.substr(dot + 1);
    if (key.size() > 2 && key[key.size() - 2] == '0') key.pop_back();  // r02 is an entry of r0
    std::string word = text(name.substr(0, dot), "{ ", key, " = false }");
    if (std::find(words.begin(), words.end(), word) == words.end()) words.push_back(std::move(word));
  }
  return join(words, " or ");
}

/// Advice on contradicting values.
std::string remedy(const StartSystem& s, const Conflict& conflict) {
  const std::string parts = parts_to_release(s, conflict);
  return parts.empty()
             ? text("\n  Leave one of them out of fix, move it to guess, or move all as little as ",
                    "possible: nearest = true")
             : text("\n  ", parts, " leaves it to the other equations; nearest = true in init moves ",
                    "all as little as possible");
}

}  // namespace

void explain_conflict(const StartSystem& s, const StartSolution& failed) {
  Selection only_equations{std::vector<char>(s.rows.size(), 1), {}};
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) only_equations.rows[i] = 0;
  const bool solvable = s.fixes() > 0 && solve_start(s, only_equations).solved;
  Conflict conflict = solvable ? smallest_conflict(s, failed) : Conflict{};
  bool proved = solvable && is_proved(s, conflict);
  if (auto one = conflict_in_one_equation(s);
      one && (!proved || one->fixes.size() <= conflict.fixes.size())) {
    conflict = std::move(*one);
    proved = true;
  }
  if (const auto other = proved ? std::nullopt : proved_conflict(s)) {
    conflict = *other;
    proved = true;
  }
  if (!solvable && !proved) {
    Index worst = 0;
    failed.residual.head(static_cast<Index>(s.first_fix)).maxCoeff(&worst);
    const auto row = static_cast<std::size_t>(worst);
    const auto point = s.point(failed.w);
    const double value = pendula::evaluate({&s.rows[row], 1}, point)[0];
    throw Failure(text("no consistent start was found; the worst residual remains in ", s.label(row),
                       ":  0 ≠ ", rounded(value, 4), " = ", truncated_text(s.rows[row]),
                       ". Give a guess near the solution: guess = { … }"));
  }
  std::vector<std::string> fixes;
  for (std::size_t i : conflict.fixes) fixes.push_back(s.label(i));
  auto violated = violations(s, conflict);
  if (violated.empty()) violated = given_by_equations(s, conflict);
  const std::string list = join(fixes, ", ");
  if (proved && fixes.empty())
    throw Error(text("no consistent start was found: the equations have no solution",
                     violated.empty() ? "" : ":\n  " + join(violated, "\n  ")));
  if (proved)
    throw Error(text("the fixed values contradict each other and the constraints.\n  conflict: ", list,
                     violated.empty() ? "" : "\n  violated: " + join(violated, "\n            "),
                     remedy(s, conflict)));
  throw Failure(text("no start was found with all of the fixed values; that there is none is not proved.",
                     "\n  not found together: ", list,
                     violated.empty() ? "" : "\n  closest:  " + join(violated, "\n            "),
                     "\n  Give guesses near a solution: guess = { … }; or leave one of them out of fix,",
                     " or move all as little as possible: nearest = true"));
}

}  // namespace pendula::dae
