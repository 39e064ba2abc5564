// Error messages of init(): conflicting values, undetermined values, expressions without value.
#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/singular/singularity_conditions.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

bool takes_part(double residual) { return residual > 1e-8; }

/// "x = 3, y = 0.5"
std::string values_of(const std::vector<Expr>& list, const std::unordered_map<Expr, double>& point) {
  std::vector<std::string> words;
  for (Expr leaf : list) words.push_back(text(to_text(leaf), " = ", rounded(point.at(leaf), 6)));
  return join(words, ", ");
}

std::vector<Expr> unknowns_in(const StartSystem& s, Expr e) {
  std::vector<Expr> found;
  for (Expr leaf : leaves({&e, 1}))
    if (s.position(leaf)) found.push_back(leaf);
  return found;
}

// ── undefined ──

struct Undefined {
  Expr node;
  std::size_t row;
  bool slope;
};

std::optional<Undefined> undefined_at(const StartSystem& s, const std::unordered_map<Expr, double>& point) {
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    if (const auto node = first_undefined(s.equation(i), point)) return Undefined{*node, i, false};
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    for (Expr leaf : unknowns_in(s, s.rows[i])) {
      const Expr slope = partial(s.equation(i), leaf);
      if (first_undefined(slope, point)) return Undefined{leaf, i, true};
    }
  return {};
}

// ── conflicts ──

/// Rows that still contain unknowns that are not fixed are solved for these and substituted, as long as they
/// are linear in them. What is left are conditions on the fixed values alone.
std::vector<Expr> conditions_on_fixed(const StartSystem& s, std::vector<Expr> rows,
                                      const std::vector<Expr>& fixed,
                                      const std::unordered_map<Expr, double>& point) {
  const auto is_fixed = [&](Expr leaf) { return std::find(fixed.begin(), fixed.end(), leaf) != fixed.end(); };
  for (bool again = true; again;) {
    again = false;
    for (std::size_t i = 0; i < rows.size() && !again; ++i)
      for (Expr leaf : unknowns_in(s, rows[i])) {
        if (is_fixed(leaf)) continue;
        const Expr slope = simplify(partial(rows[i], leaf));
        if (slope.is_zero() || depends_on(slope, leaf)) continue;
        const double value = pendula::evaluate({&slope, 1}, point)[0];
        if (!std::isfinite(value) || std::fabs(value) < 1e-9) continue;
        const Expr solution = -substitute(rows[i], {{leaf, Expr(0)}}) / slope;
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(i));
        for (Expr& other : rows) other = tidied(substitute(other, {{leaf, solution}}));
        again = true;
        break;
      }
  }
  std::erase_if(rows, [&](Expr e) {
    const auto inside = unknowns_in(s, e);
    return !is_short(e, 200) || !std::all_of(inside.begin(), inside.end(), is_fixed);
  });
  return rows;
}

struct Conflict {
  std::vector<std::size_t> fixes, equations;  ///< rows of the system
};

/// Drops every fix that is not needed for the contradiction; then the rows in which something is left.
Conflict smallest_conflict(const StartSystem& s, const StartSolution& failed) {
  constexpr std::size_t most_trials = 40;
  Selection selection{std::vector<char>(s.rows.size(), 1), {}};
  std::vector<std::size_t> candidates;
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) candidates.push_back(i);
  if (candidates.size() > most_trials)  // where the least-squares solution leaves nothing, nothing conflicts
    std::erase_if(candidates, [&](std::size_t i) {
      const bool quiet = !takes_part(failed.residual[static_cast<Index>(i)]);
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
    if (takes_part(least.residual[static_cast<Index>(i)])) conflict.equations.push_back(i);
  if (conflict.equations.size() > most_trials) return conflict;
  const auto all = conflict.equations;
  for (auto i = all.rbegin(); i != all.rend(); ++i) {  // what was written by the user stays longest
    selection.rows[*i] = 0;
    if (solve_start(s, selection).solved)
      selection.rows[*i] = 1;
    else
      std::erase(conflict.equations, *i);
  }
  return conflict;
}

/// The equations at the fixed values, with the other unknowns as near to a solution as they come.
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
  for (Index j = 0; j < w.size() && w.size() <= dense_up_to;
       ++j) {  // minima are flat: 0 reads better than 1e-4
    if (selection.held[j] || std::fabs(w[j]) > 0.01 * s.unit[j]) continue;
    const double before = size(), old = std::exchange(w[j], 0);
    if (!(size() <= before * 1.001)) w[j] = old;
  }
  return s.point(w);
}

std::string short_label(const StartSystem& s, std::size_t row) {
  constexpr std::string_view word = "equation ";
  const std::string label = s.label(row);
  return label.starts_with(word) ? label.substr(word.size()) : label;
}

/// Equations all of whose unknowns are fixed, where the given values violate them.
std::vector<std::string> violations_of_given_values(const StartSystem& s, const Conflict& conflict) {
  Vec w = first_point(s, 0);
  std::unordered_set<Expr> fixed;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k)) {
      w[*j] = s.request.fix[k].second;
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
    if (std::fabs(value) > 1e-9 * std::max(1.0, size_of_terms(e, point)))
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
  const auto rounding = [&](Expr e) { return 1e-12 * std::min(1.0, size_of_terms(e, point)); };
  constexpr std::size_t readable = 8;
  if (equations.size() <= readable)
    for (Expr e : conditions_on_fixed(s, equations, fixed, point))
      if (std::isfinite(value(e)) && std::fabs(value(e)) > rounding(e))
        lines.push_back(
            text(join(labels, ", "), ":  0 ≠ ", rounded(value(e), 6), " = ", truncated_text(tidied(e))));
  if (lines.empty()) lines = violations_of_given_values(s, conflict);
  if (!lines.empty()) return lines;
  for (std::size_t k = 0; k < equations.size() && k < readable; ++k)
    if (std::fabs(value(equations[k])) > rounding(equations[k]))
      lines.push_back(text(labels[k], ":  0 ≠ ", rounded(value(equations[k]), 6), " = ",
                           truncated_text(equations[k]), "  at ",
                           values_of(unknowns_in(s, equations[k]), point)));
  return lines;
}

/// Fixed values of what the equations give as a number.
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

// ── freedom ──

/// "(x, y) may move along (1, -2)", one line for every direction, each with its own recommended unknown.
std::vector<std::string> directions(const StartSystem& s, const Freedom& open) {
  constexpr Index most = 3;
  const Index n = open.undetermined.cols();
  if (n == 0 || n > most || static_cast<Index>(open.recommended.size()) != n || open.open.size() > 12)
    return {};
  Mat chosen(n, n);
  for (Index k = 0; k < n; ++k) chosen.row(k) = open.undetermined.row(open.recommended[k]);
  const Mat N = open.undetermined * chosen.inverse();
  std::vector<std::string> lines;
  for (Index k = 0; k < n; ++k) {
    const Index lead = open.recommended[k];
    std::vector<std::string> names, numbers;
    for (Index j : open.open) {
      const double step = N(j, k) * s.unit[j] / s.unit[lead];
      if (std::fabs(N(j, k)) < 1e-9) continue;
      names.push_back(to_text(s.unknowns[j]));
      numbers.push_back(rounded(step, 5));
    }
    lines.push_back(names.size() == 1
                        ? text(names[0], " may move alone")
                        : text("(", join(names, ", "), ") may move along (", join(numbers, ", "), ")"));
  }
  return lines;
}

bool works(const ModelPtr& model, const StartRequest& request) {
  try {
    init(model, request);
    return true;
  } catch (const UserFacing&) {
    return false;
  }
}

/// A request that leaves nothing open: zeros if they will do, else values like those of the point.
std::optional<LeafValues> completion(const ModelPtr& model, const StartSystem& s, const Vec& w,
                                     const Freedom& open) {
  static thread_local bool searching = false;  // a trial may be incomplete again: its error needs no advice
  if (searching || w.size() > dense_up_to) return {};
  searching = true;
  std::optional<LeafValues> found;
  for (int digits : {0, 1, 2, 4, 12}) {
    LeafValues more;
    for (Index j : open.recommended)
      more.push_back({s.unknowns[j], digits ? std::stod(rounded(w[j], digits)) : 0.0});
    StartRequest request = s.request;
    request.fix.insert(request.fix.end(), more.begin(), more.end());
    if (!works(model, request)) continue;
    found = more;
    break;
  }
  searching = false;
  return found;
}

}  // namespace

std::string key_text(Expr leaf) {
  const Symbol& symbol = symbol_of(leaf);
  const std::string name =
      symbol.vector.empty() ? symbol.name : text(symbol.vector, "[", symbol.component, "]");
  if (symbol.order == 0) return symbol.vector.empty() ? name : "[" + name + "]";
  if (symbol.order > 2) return text("[der(", name, ", ", symbol.order, ")]");
  return text("[", name, symbol.order == 1 ? ".dot]" : ".ddot]");
}

std::string call_text(const LeafValues& fix, const LeafValues& guess) {
  const auto table = [](const LeafValues& values) {
    std::vector<std::string> words;
    for (const auto& [leaf, value] : values) words.push_back(text(key_text(leaf), " = ", rounded(value)));
    return "{ " + join(words, ", ") + " }";
  };
  std::string call = "sys:init{";
  if (!fix.empty()) call += " fix = " + table(fix);
  if (!guess.empty()) call += text(fix.empty() ? "" : ",", " guess = ", table(guess));
  return call + " }";
}

void explain_undefined(const StartSystem& s) {
  const auto point = s.point(first_point(s, 0));
  require_nonsingular(s.model, point);
  const auto bad = undefined_at(s, point);
  if (!bad)
    throw Failure("no consistent start was found: the equations have no finite values near the guess");
  const std::string equation = text(s.label(bad->row), "  0 = ", truncated_text(s.equation(bad->row)));
  std::vector<Expr> guilty = bad->slope ? std::vector<Expr>{bad->node} : unknowns_in(s, bad->node);
  const std::string at = guilty.empty() ? "" : " at " + values_of(guilty, point);
  const bool held = !guilty.empty() && s.fixed()[*s.position(guilty[0])];
  const std::string advice =
      guilty.empty() ? "check the parameters and inputs"
      : held         ? text("fix ", to_text(guilty[0]), " where it has one")
                     : text("give a guess where it has one: guess = { ", key_text(guilty[0]), " = … }");
  if (bad->slope)
    throw Error(
        text(equation, " has no finite derivative with respect to ", to_text(bad->node), at, "; ", advice));
  throw Error(text(equation, " has no value", at, ": ", to_text(bad->node), " is undefined; ", advice));
}

void explain_stuck(const StartSystem& s, std::size_t row) {
  const auto point = s.point(first_point(s, 0));
  const auto inside = unknowns_in(s, s.rows[row]);
  throw Failure(text(
      "no consistent start was found: ", s.label(row), "  0 = ", truncated_text(s.equation(row)),
      " does not hold at the values given, and none of its unknowns changes it to first order "
      "there (its gradient "
      "is 0 at ",
      values_of(inside, point), "). Points that should be apart coincide? Give values with more digits"));
}

void explain_conflict(const ModelPtr& model, const StartSystem& s, const StartSolution& failed) {
  static_cast<void>(model);
  Selection only_equations{std::vector<char>(s.rows.size(), 1), {}};
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) only_equations.rows[i] = 0;
  if (s.fixes() == 0 || !solve_start(s, only_equations).solved) {
    Index worst = 0;
    failed.residual.head(static_cast<Index>(s.first_fix)).maxCoeff(&worst);
    const auto row = static_cast<std::size_t>(worst);
    const auto point = s.point(failed.w);
    const double value = pendula::evaluate({&s.rows[row], 1}, point)[0];
    throw Failure(text("no consistent start was found; the worst residual remains in ", s.label(row),
                       ":  0 ≠ ", rounded(value, 4), " = ", truncated_text(s.rows[row]),
                       ". Give a guess near the solution: guess = { … }"));
  }
  const Conflict conflict = smallest_conflict(s, failed);
  std::vector<std::string> fixes;
  for (std::size_t i : conflict.fixes) fixes.push_back(s.label(i));
  auto violated = violations(s, conflict);
  if (violated.empty()) violated = given_by_equations(s, conflict);
  const std::string lines = violated.empty() ? "" : "\n  violated: " + join(violated, "\n            ");
  throw Error(text(
      "the fixed values contradict each other and the constraints.\n  conflict: ", join(fixes, ", "), lines,
      "\n  Leave one of them out of fix, move it to guess, or move all as little as possible: "
      "nearest = true"));
}

static std::vector<Expr> leaves_of(const StartSystem& s, const std::vector<Index>& places) {
  std::vector<Expr> list;
  for (Index j : places) list.push_back(s.unknowns[j]);
  return list;
}

void explain_freedom(const ModelPtr& model, const StartSystem& s, const Vec& w, const Freedom& open) {
  const auto name = [&](Index j) { return to_text(s.unknowns[j]); };
  constexpr std::size_t most = 24;
  std::vector<std::string> candidates, redundant;
  for (Index j : open.open)
    if (candidates.size() < most) candidates.push_back(name(j));
  if (open.open.size() > most) candidates.push_back(text("… (", open.open.size(), " in all)"));
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (open.redundant[k]) redundant.push_back(s.label(s.first_fix + k));
  std::string why;
  const int more = static_cast<int>(s.first_fix) - open.rank_equations;
  if (s.request.keep_invariants && more > 0)
    why += text("\n  The equations are singular here: rank ", open.rank_equations, " of ", s.first_fix,
                ". Another point may be regular: guess = { … }");
  if (!redundant.empty())
    why += text("\n  ", join(redundant, ", "), redundant.size() == 1 ? " is" : " are",
                " determined by the rest already at this point, so ",
                redundant.size() == 1 ? "it leaves" : "they leave", " open what others would decide");
  if (s.fixes() > 0 || !why.empty())
    for (const std::string& line : directions(s, open)) why += "\n  " + line;
  std::vector<std::string> choice;
  for (Index j : open.recommended)
    if (choice.size() < most) choice.push_back(name(j));
  std::string example = "for example fix: " + join(choice, ", ");
  constexpr std::size_t short_list = 12;
  if (const auto more_fixes = completion(model, s, w, open);
      more_fixes && s.fixes() + more_fixes->size() <= short_list) {
    LeafValues all = s.request.fix;
    all.insert(all.end(), more_fixes->begin(), more_fixes->end());
    example += text(", as in ", call_text(all, s.request.guess));
  }
  throw Error(text(open.count, open.count == 1 ? " initial value is" : " initial values are",
                   " neither fixed nor determined.\n  candidates: ", join(candidates, ", "), why, "\n  ",
                   example,
                   "\n  (or a guess for them, which chooses the values nearest to it: guess = { … })",
                   redundancy_hint(model, leaves_of(s, open.open))));
}

}  // namespace pendula::dae
