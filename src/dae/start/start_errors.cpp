// Error messages of init(): undetermined values, expressions without value.
#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/lua_name.hpp"
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

// ── freedom ──

/// "(x, y) may move along (1, -2)": one line per direction, each with a recommended unknown of its own.
std::vector<std::string> directions(const StartSystem& s, const Freedom& open) {
  constexpr Index most = 3;
  const Index n = open.undetermined.cols();
  if (n == 0 || n > most || static_cast<Index>(open.recommended.size()) != n || open.open.size() > 12)
    return {};
  Mat chosen(n, n);
  for (Index k = 0; k < n; ++k) chosen.row(k) = open.undetermined.row(open.recommended[k]);
  const Mat N = open.undetermined * inverse_by_lu(chosen);
  std::vector<std::string> lines;
  for (Index k = 0; k < n; ++k) {
    const Index lead = open.recommended[k];
    std::vector<std::string> names, numbers;
    for (Index j : open.open) {
      const double step = N(j, k) * s.unit[j] / s.unit[lead];
      constexpr double rounding = 1e-9;  // of components of null vectors, where the chosen ones are 1
      if (std::fabs(N(j, k)) < rounding) continue;
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

/// Values that complete the request: zeros if possible, else values like those at the point.
std::optional<LeafValues> completion(const ModelPtr& model, const StartSystem& s, const Vec& w,
                                     const Freedom& open) {
  static thread_local bool searching = false;  // a trial may be incomplete as well; its error needs no advice
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

std::string key_text(Expr leaf) {
  const Symbol& symbol = symbol_of(leaf);
  const std::string name =
      symbol.vector.empty() ? symbol.name : text(symbol.vector, "[", symbol.component, "]");
  const std::string& declared = symbol.vector.empty() ? symbol.name : symbol.vector;
  if (!is_lua_name(declared))  // the path of a part is written as text
    return text("[\"", name, symbol.order == 1 ? ".dot" : std::string(symbol.order, '\''), "\"]");
  if (symbol.order == 0) return symbol.vector.empty() ? name : "[" + name + "]";
  if (symbol.order > 2) return text("[der(", name, ", ", symbol.order, ")]");
  return text("[", name, symbol.order == 1 ? ".dot]" : ".ddot]");
}

static std::string table_text(const LeafValues& values) {
  std::vector<std::string> words;
  for (const auto& [leaf, value] : values) words.push_back(text(key_text(leaf), " = ", rounded(value)));
  return "{ " + join(words, ", ") + " }";
}

std::string call_text(const LeafValues& fix, const LeafValues& guess) {
  std::string call = "sys:init{";
  if (!fix.empty()) call += " fix = " + table_text(fix);
  if (!guess.empty()) call += text(fix.empty() ? "" : ",", " guess = ", table_text(guess));
  return call + " }";
}

/// "; c.s is 0 there": eliminated variables in e that vanish. If e has no value, it divides by one of them,
/// such as the length of a spring.
static std::string vanishing(const StartSystem& s, Expr e, const std::unordered_map<Expr, double>& point) {
  const std::vector<Expr> nodes = topological({&e, 1});
  const std::unordered_set<Expr> inside(nodes.begin(), nodes.end());
  std::vector<std::string> names;
  for (const Model* m = &s.model; m; m = m->parent.get())
    for (const auto& [leaf, value] : m->relations) {
      const Expr own = resolve(s.model, leaf);
      if (own.is_symbol() || own.is_constant() || !inside.contains(own) ||
          pendula::evaluate({&own, 1}, point)[0] != 0)
        continue;
      const std::string name = to_text(leaf);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  if (names.empty()) return "";
  std::sort(names.begin(), names.end());
  return text("; ", join(names, ", "), names.size() == 1 ? " is 0 there" : " are 0 there");
}

void explain_undefined(const ModelPtr& model, const StartSystem& s) {
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
  const std::string undefined = text(equation, " has no value", at, ": ", to_text(bad->node), " is undefined",
                                     vanishing(s, bad->node, point));
  if (const std::string smooth = smooth_values(model, s.request); !smooth.empty())
    throw Error(text(undefined, ".\n  The solution that continues smoothly has ", smooth,
                     ".\n  Start near it: another time, or other values in fix or guess"));
  throw Error(text(undefined, "; ", advice));
}

void explain_stuck(const StartSystem& s, std::size_t row) {
  const auto point = s.point(first_point(s, 0));
  const auto inside = unknowns_in(s, s.rows[row]);
  throw Failure(text(
      "no consistent start was found: ", s.label(row), "  0 = ", truncated_text(s.equation(row)),
      " does not hold at the values given, and none of its unknowns changes "
      "it to first order there (its gradient is 0 at ",
      values_of(inside, point), "). Do points coincide that should be apart? Give values with more digits"));
}

static std::vector<Expr> leaves_of(const StartSystem& s, const std::vector<Index>& places) {
  std::vector<Expr> list;
  for (Index j : places) list.push_back(s.unknowns[j]);
  return list;
}

/// Explains a point at which the equations lose rank: the vanishing expressions, and the solutions
/// that meet there.
static std::string singular_here(const ModelPtr& model, const StartSystem& s, const Vec& w, int rank) {
  const Crossing crossing = crossing_at(model, s, w);
  std::string words = text("\n  The equations are singular here", crossing.factors.empty() ? "" : ", where ",
                           crossing.factors, ": rank ", rank, " of ", s.first_fix, ". ");
  if (crossing.continuations.empty()) return words + "Another point may be regular: guess = { … }";
  return words + text("Solutions meet here and go on with ", crossing.continuations,
                      ":\n  begin near this point, guess = { … }, or choose one in integrate, branch = ",
                      crossing.choices);
}

void explain_freedom(const ModelPtr& model, const StartSystem& s, const Vec& w, const Freedom& open) {
  const auto name = [&](Index j) { return to_text(s.unknowns[j]); };
  constexpr std::size_t most = 24;  // names: two lines
  std::vector<std::string> candidates, redundant;
  for (Index j : open.open)
    if (candidates.size() < most) candidates.push_back(name(j));
  if (open.open.size() > most) candidates.push_back(text("… (", open.open.size(), " in all)"));
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (open.redundant[k]) redundant.push_back(s.label(s.first_fix + k));
  std::string why;
  const int more = static_cast<int>(s.first_fix) - open.rank_equations;
  if (s.request.keep_invariants && more > 0) why += singular_here(model, s, w, open.rank_equations);
  if (!redundant.empty())
    why += text("\n  ", join(redundant, ", "), redundant.size() == 1 ? " is" : " are",
                " already determined by the rest at this point, so fixing ",
                redundant.size() == 1 ? "it" : "them", " does not determine the others");
  if (s.fixes() > 0 || !why.empty())
    for (const std::string& line : directions(s, open)) why += "\n  " + line;
  std::vector<std::string> choice;
  for (Index j : open.recommended)
    if (choice.size() < most) choice.push_back(name(j));
  std::string example = "for example fix: " + join(choice, ", ");
  constexpr std::size_t short_list = 12;  // names: one line
  const auto more_fixes = completion(model, s, w, open);
  if (!more_fixes && w.size() <= dense_up_to)
    example = text("open: ", join(choice, ", "),
                   "; neither 0 nor the values of the point that was found give a start");
  if (more_fixes && s.fixes() + more_fixes->size() <= short_list) {
    LeafValues all = s.request.fix;
    all.insert(all.end(), more_fixes->begin(), more_fixes->end());
    example +=
        text(", as in ", s.request.of_run ? "start = " + table_text(all) : call_text(all, s.request.guess));
  }
  const char* guess = s.request.of_run ? "start = sys:init{ fix =, guess = { … } }" : "guess = { … }";
  throw Error(text(open.count, open.count == 1 ? " initial value is" : " initial values are",
                   " neither fixed nor determined.\n  candidates: ", join(candidates, ", "), why, "\n  ",
                   example, "\n  (or a guess for them, which chooses the values nearest to it: ", guess, ")",
                   redundancy_hint(model, leaves_of(s, open.open))));
}

}  // namespace pendula::dae
