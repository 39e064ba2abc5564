#include "dae/index/differentiation_index.hpp"

#include <algorithm>
#include <optional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/analysis/unsolvable.hpp"
#include "dae/index/array_index.hpp"
#include "dae/index/hidden_constraints.hpp"
#include "dae/index/near_singular.hpp"
#include "dae/index/open_direction.hpp"
#include "dae/index/structural_index_check.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/model/piecewise.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/points/consistent_point_rank.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/least_norm.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/signature.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t array_affordable =
    12;  // unknowns of a nonlinear model up to which numeric ranks are computed

IndexResult from_structure(const Analysis& a, const std::string& by) {
  IndexResult t;
  t.index = a.index;
  t.dof = a.dof;
  t.evidence = by;
  return t;
}

/// An elimination that shows why a pencil is singular: "(2) - (1):  0 = 1 …".
std::string why_singular(const Model& m) {
  std::vector<std::string> tried;
  regularise(std::make_shared<const Model>(m), &tried);
  std::string out;
  for (const std::string& line : tried) out += "\n  " + line;
  return out;
}

std::optional<IndexResult> from_pencil(const Model& m) {
  const auto form = linear_form(m);
  if (!form) return {};
  LinearIndex linear = linear_index(*form);
  if (!linear.regular)
    throw Failure(text(
        "the pencil sE - A is singular (det(sE - A) = 0 for every s): the equations depend on each other or "
        "leave unknowns undetermined, so there is no index; sys:pencil() shows which",
        why_singular(m)));
  IndexResult t;
  t.index = linear.index;
  t.dof = linear.dof;
  t.conditions = IndexResult::Conditions::found;
  t.found = std::move(linear.constraints);
  t.evidence = "shuffle algorithm, exact";
  return t;
}

std::vector<Constraint> array_constraints(const ArrayResult& array) {
  std::vector<Constraint> list;
  for (const ArrayCondition& c : array.constraints) list.push_back({c.residual, -1, 0, c.derivative, c.from});
  return list;
}

/// Replaces "(6*)" in a label, which is no equation of the user, by the combination it denotes.
std::string in_given_equations(std::string label, const Model& regularised) {
  constexpr int deepest = 3;  // nested combinations; an equation may have been replaced twice
  for (int depth = 0; depth < deepest && label.find("*)") != std::string::npos; ++depth)
    for (std::size_t i = 0; i < regularised.residuals.size(); ++i) {
      const auto [block, row] = regularised.origin[i];
      const auto& how = regularised.blocks[block].rewritten;
      if (static_cast<std::size_t>(row) >= how.size() || how[row].empty()) continue;
      const std::string star = regularised.label(i), &note = how[row];
      const std::string meaning = label == star ? note : "(" + note + ")";
      for (std::size_t k = 0; (k = label.find(star, k)) != std::string::npos; k += meaning.size())
        label.replace(k, star.size(), meaning);
    }
  return label;
}

/// The conditions of a regularised model, in the unknowns and equations of the original one.
std::vector<Constraint> in_given_terms(std::vector<Constraint> list, const Regularised& regularised) {
  for (Constraint& c : list) {
    c.residual = substitute(c.residual, regularised.definitions);
    std::string label = in_given_equations(c.label, *regularised.model);
    if (label != c.label) {
      c.origin.reset();
      c.label = std::move(label);
    }
  }
  std::stable_sort(list.begin(), list.end(), [](const Constraint& a, const Constraint& b) {
    return display_width(a.label) < display_width(b.label);  // an original equation first, then combinations
  });
  return list;
}

std::vector<Constraint> regularised_constraints(const Regularised& regularised) {
  const Model& m = *regularised.model;
  return in_given_terms(hidden_constraints_by_offsets(m, require_regular(m)), regularised);
}

IndexResult from_array(const ModelPtr& model, const Analysis& a, const ArrayResult& array) {
  IndexResult t;
  t.index = *array.index;
  t.dof = *array.dof;
  t.evidence =
      array.exact ? "derivative array, exact" : text("derivative array, ranks at ", array.points, " points");
  if (a.regular && a.dof == array.dof) return t;
  t.found = array_constraints(array);
  t.complete = static_cast<int>(t.found.size()) == array.conditions;
  const bool leads_further = !t.complete && regularise(model);
  t.conditions = leads_further ? IndexResult::Conditions::of_regularised : IndexResult::Conditions::found;
  return t;
}

[[noreturn]] void fail_no_index(const Model& m, const Analysis& a, const ArrayResult* array,
                                const std::vector<std::string>& tried) {
  if (const std::string none = a.jacobian_status == JacobianStatus::unmatched ? "" : why_unsolvable(m);
      !none.empty())
    throw Failure("no index can be given: " + none);
  std::string why = why_not_regular(m, a);
  if (const std::string open = why_forces_are_open(m); !open.empty())
    throw Failure("no index can be given: " + open);
  if (array) why += "\n  derivative array: " + array->text;
  for (const std::string& line : tried) why += "\n  " + line;
  throw Failure("no index can be given: " + why);
}

/// Can det J be formed, without a factor that can vanish?
bool regular_everywhere(const Model& m, const Analysis& a) {
  const DeterminantFactors v = determinant_factors(m, a, blocks_of(m, a));
  return v.complete && v.conditions.empty();
}

/// Is the structural index exact where J has its generic rank? (sigma.hpp)
bool exact_in_general(const Model& m, const Analysis& a) {
  std::vector<int> orders;
  for (const Variable& v : m.variables) orders.push_back(v.order);
  const LowerIndexRows lower = lower_index_rows(a.offsets, orders);
  std::vector<int> row(m.residuals.size(), -1), column(m.variables.size(), -1);
  for (std::size_t k = 0; k < lower.rows.size(); ++k) row[lower.rows[k]] = static_cast<int>(k);
  for (std::size_t k = 0; k < lower.other_columns.size(); ++k)
    column[lower.other_columns[k]] = static_cast<int>(k);
  std::vector<Entry> part;
  for (const Entry& e : a.jacobian)
    if (row[e.row] >= 0 && column[e.column] >= 0) part.push_back({row[e.row], column[e.column], e.value});
  const int rank =
      modular_rank(part, static_cast<int>(lower.rows.size()), static_cast<int>(lower.other_columns.size()))
          .rank;
  return lower.cannot_determine(rank);
}

/// The derivative array lowers an upper bound until it reaches it: that is the index.
void confirm_by_array(const Model& m, IndexResult& t) {
  constexpr int enough = 2;  // points; a single one may be an accident
  while (t.index_is_bound && t.index > 0) {
    if (const int points = points_beyond(m, t.index - 1); points >= enough) {
      t.evidence += text(", and derivative array at ", points, " points");
      t.index_is_bound = false;
    } else if (points_determined(m, t.index - 1) >= enough) {
      --t.index;
    } else {
      return;
    }
  }
}

/// The index by structure, with the number of points at which it was confirmed.
IndexResult confirmed_structure(const Model& m, const Analysis& a) {
  const auto n = static_cast<int>(m.variables.size());
  std::string by = "structure, system Jacobian regular";
  if (a.solutions && a.solutions->most == n)
    by += ", also at a consistent point";
  else if (a.solutions)
    by += "; no consistent point was found to confirm it";
  else if (n > ConsistentPointRank::affordable && regular_everywhere(m, a))
    by += " at every point";
  else if (n > ConsistentPointRank::affordable)
    by += text("; not confirmed at consistent points (more than ", ConsistentPointRank::affordable,
               " equations)");
  IndexResult t = from_structure(a, by);
  const bool at_points = a.solutions && a.solutions->points > 0;
  t.is_unconfirmed = a.solutions && !at_points;
  t.index_is_bound = a.index > 1 && !(at_points ? a.solutions->index_proved > 0 : exact_in_general(m, a));
  confirm_by_array(m, t);
  return t;
}

/// The derivative array at consistent points of the regularised equations, which Newton's method
/// finds more easily.
ArrayResult array_from_regularised(const Model& m, const Regularised& r, ArrayOptions options) {
  constexpr int seeds = 8;  // starting values
  const Model& other = *r.model;
  const Analysis a = analyse(other);
  if (!a.regular || other.variables.size() > ConsistentPointRank::affordable) return {};
  const ConsistentPointRank points(residuals_at_values(other), unknowns_of(other), a.offsets, a.jacobian);
  if (!points.applies()) return {};
  for (int seed = 0; seed < seeds && static_cast<int>(options.from.size()) < options.points; ++seed)
    if (auto values = points.consistent_values(seed)) options.from.emplace_back(seed, std::move(*values));
  return options.from.empty() ? ArrayResult{} : derivative_array(m, options);
}

/// The derivative array of a large model, without its conditions.
std::optional<IndexResult> from_directions(const Model& m, const ArrayOptions& options) {
  constexpr std::size_t small = 100;  // equations: dense ranks would have found points, too
  if (m.residuals.size() < small) return {};
  const auto found = index_by_directions(DerivativeArray(without_calls(residuals_at_values(m)), m.variables),
                                         options.max_order);
  if (!found) return {};
  IndexResult t;
  t.index = found->index;
  t.dof = found->dof;
  t.evidence = "derivative array, directions of x′ at 2 points";
  t.conditions = IndexResult::Conditions::found;
  t.complete = t.dof == static_cast<int>(m.states().size());
  return t;
}

IndexResult without_regular_structure(const ModelPtr& model, const Analysis& a, const ArrayResult& array,
                                      const ArrayOptions& options) {
  if (array.verdict == ArrayVerdict::determined) return from_array(model, a, array);
  std::vector<std::string> tried;
  const auto regularised = regularise(model, &tried);
  if (!regularised && array.verdict == ArrayVerdict::not_covered)
    if (const auto t = from_directions(*model, options)) return *t;
  if (!regularised || array.verdict != ArrayVerdict::not_covered) fail_no_index(*model, a, &array, tried);
  const ArrayResult again = array_from_regularised(*model, *regularised, options);
  if (again.verdict == ArrayVerdict::determined && again.dof == regularised->dof)
    return from_array(model, a, again);
  IndexResult t =
      from_structure(require_regular(*regularised->model), "structure of the regularised equations");
  t.conditions = IndexResult::Conditions::of_regularised;
  t.index = regularised->differentiations;
  t.index_is_bound = t.index > 1;
  confirm_by_array(*model, t);
  return t;
}

IndexResult find(const Model& m, const Analysis& a) {
  // Reduced forms are regular by construction. Their equations do not contain their conditions, or their
  // states are exchanged where they become singular.
  if (!m.invariants.empty() || ((m.form == "dummy" || m.form == "array") && a.regular)) {
    if (!a.regular) fail_no_index(m, a, nullptr, {});
    return from_structure(a, "structure of a reduced form, system Jacobian regular");
  }
  if (a.jacobian_status == JacobianStatus::unmatched) fail_no_index(m, a, nullptr, {});
  if (auto t = from_pencil(m)) return *t;
  if (a.regular)  // otherwise fail_no_index() reports it
    if (const std::string why = why_unsolvable(m); !why.empty())
      throw Failure("no index can be given: " + why);
  if (a.regular && a.dof == 0 && a.index > 1)
    if (const std::string open = why_forces_are_open(m); !open.empty())
      throw Failure(text("no index can be given for all positions: where nothing moves it is ", a.index,
                         "; where the mechanism moves, ", open));
  if (a.regular && m.variables.size() > array_affordable) return confirmed_structure(m, a);
  if (const int points = a.regular ? points_of_agreement(m, a) : 0)
    return from_structure(a, text("structure and derivative array, ranks at ", points, " points"));
  const auto model = std::make_shared<const Model>(m);
  ArrayOptions options;
  options.conditions = !a.regular;  // otherwise the conditions are those of the structure
  const ArrayResult array = derivative_array(m, options);
  if (!a.regular) return without_regular_structure(model, a, array, options);
  if (array.verdict == ArrayVerdict::determined && array.dof == a.dof && array.index <= a.index)
    return from_array(model, a, array);
  IndexResult t = confirmed_structure(m, a);
  if (array.verdict == ArrayVerdict::determined)
    t.notes.push_back("on another branch of the solutions, where the system Jacobian is singular: " +
                      array.text);
  if (array.verdict == ArrayVerdict::varying || array.verdict == ArrayVerdict::singular)
    t.notes.push_back("derivative array: " + array.text);
  return t;
}

std::size_t length_of(const std::vector<Constraint>& list) {
  std::size_t nodes = 0;
  for (const Constraint& c : list) nodes += topological({&c.residual, 1}).size();
  return nodes;
}

HiddenConstraints written_down(const Model& m, const Analysis& a, const IndexResult& t) {
  if (t.conditions == IndexResult::Conditions::found) return {t.found, t.complete};
  if (t.conditions == IndexResult::Conditions::by_offsets) return {hidden_constraints_by_offsets(m, a), true};
  const auto regularised = regularise(std::make_shared<const Model>(m));
  if (!regularised) return {t.found, t.complete};
  return {regularised_constraints(*regularised), true};
}

/// Completes the conditions on the states to their known number. If elimination does not find all of them,
/// the list stays as it is and is marked incomplete.
void complete_constraints(const Model& m, const Analysis& a, const IndexResult& t, HiddenConstraints& known) {
  const int wanted = static_cast<int>(m.states().size()) - t.dof;
  const bool clean = on_states_only(m, known.constraints);
  if (clean && static_cast<int>(known.constraints.size()) == wanted) return void(known.complete = true);
  const int order = std::max(t.index - 1, 0);
  Model there = m;
  if (a.jacobian_status == JacobianStatus::at_values) there.residuals = residuals_at_values(m);
  auto rows = a.regular ? rows_by_offsets(there, a.offsets) : rows_up_to(there, order);
  auto found = hidden_constraints_on_states(there, m.states(), std::move(rows), wanted);
  if (!a.regular)  // the regularised equations may yield more conditions, or shorter ones
    if (const auto regularised = regularise(std::make_shared<const Model>(there))) {
      auto more =
          hidden_constraints_on_states(*regularised->model, m.states(),
                                       rows_by_offsets(*regularised->model, regularised->offsets), wanted);
      if (more.size() > found.size() || (more.size() == found.size() && length_of(more) < length_of(found)))
        found = in_given_terms(std::move(more), *regularised);
    }
  known.complete = static_cast<int>(found.size()) == wanted;
  if (known.complete || !clean) known.constraints = std::move(found);
}

std::string answer_in(const Model& m) {
  try {
    const IndexResult t = find(m, analyse(m));
    return text("index ", t.index_is_bound ? "at most " : "", t.index, ", ", t.dof,
                t.dof == 1 ? " free initial value" : " free initial values");
  } catch (const UserFacing&) {
    return "no index";
  }
}

/// Adds a note if the regions of a piecewise model have different answers; returns true if so.
bool compare_regions(const Model& m, IndexResult& t) {
  if (m.variables.size() > array_affordable) return false;
  std::vector<std::string> answers, words;
  for (const Region& r : regions(m)) {
    const std::string answer = answer_in(r.model);
    words.push_back(answer + " where " + r.where);
    if (std::find(answers.begin(), answers.end(), answer) == answers.end()) answers.push_back(answer);
  }
  if (answers.size() < 2) return false;
  t.notes = {"the model is piecewise: " +
             join(words, "; ")};  // replaces notes about single points, which lie in one region
  return true;
}

struct Outcome {
  std::optional<IndexResult> result;
  std::string failure;
};

constexpr std::size_t kept = 500;  // equations; for larger models the structure decides, which is fast

}  // namespace

IndexResult differentiation_index(const Model& m, const Analysis& a) {
  static ModelCache<Outcome> cache(cached_models);
  if (m.residuals.size() > kept) return find(m, a);
  const ModelKey key = key_of(m);
  const Outcome* known = cache.find(key);
  if (!known) {
    Outcome outcome;
    try {
      outcome.result = find(m, a);
      if (m.invariants.empty() && !compare_regions(m, *outcome.result)) {
        const auto add = [&](std::optional<std::string> note) {
          if (note) outcome.result->notes.push_back(std::move(*note));
        };
        const std::string here = answer_text(outcome.result->index, outcome.result->dof);
        add(note_on_rounding(m, here, answer_in));
        if (m.form.empty()) add(note_on_pivots(m, a, here));
      }
    } catch (const Failure& e) {
      outcome.failure = e.what();
    }
    known = &cache.insert(key, std::move(outcome));
  }
  if (!known->result) throw Failure(known->failure);
  return *known->result;
}

IndexResult differentiation_index(const Model& m) { return differentiation_index(m, analyse(m)); }

HiddenConstraints hidden_constraints(const Model& m) {
  static ModelCache<HiddenConstraints> cache(cached_models);
  const Analysis a = analyse(m);
  const IndexResult t = differentiation_index(m, a);
  if (m.residuals.size() > kept) return written_down(m, a, t);
  const ModelKey key = key_of(m);
  if (const HiddenConstraints* known = cache.find(key)) return *known;
  HiddenConstraints found = written_down(m, a, t);
  if (m.invariants.empty()) complete_constraints(m, a, t, found);
  return cache.insert(key, std::move(found));
}

}  // namespace pendula::dae
