#include "dae/index/differentiation_index.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/derivative_array.hpp"
#include "dae/index/structural_index_check.hpp"
#include "dae/model/memo.hpp"
#include "dae/model/piecewise.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/singular/validity.hpp"
#include "dae/structure/conversion.hpp"
#include "dae/structure/hidden_constraints.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t array_affordable =
    12;  // unknowns of a nonlinear model for which numeric ranks are taken

Truth from_structure(const Analysis& a, const std::string& by) {
  Truth t;
  t.index = a.index;
  t.dof = a.dof;
  t.by = by;
  return t;
}

/// What makes a pencil singular, where elimination shows it: "(2) - (1):  0 = 1 …".
std::string why_singular(const Model& m) {
  std::vector<std::string> tried;
  repair(std::make_shared<const Model>(m), &tried);
  std::string out;
  for (const std::string& line : tried) out += "\n  " + line;
  return out;
}

std::optional<Truth> from_pencil(const Model& m) {
  const auto form = linear_form(m);
  if (!form) return {};
  LinearIndex linear = linear_index(*form);
  if (!linear.regular)
    throw Failure(text(
        "the pencil sE - A is singular (det(sE - A) = 0 for every s): the equations depend on each other or "
        "leave unknowns open, so there is no index; sys:pencil() shows which",
        why_singular(m)));
  Truth t;
  t.index = linear.index;
  t.dof = linear.dof;
  t.conditions = Truth::Conditions::found;
  t.found = std::move(linear.constraints);
  t.by = "shuffle algorithm, exact";
  return t;
}

std::vector<Constraint> array_constraints(const ArrayResult& array) {
  std::vector<Constraint> list;
  for (const ArrayCondition& c : array.constraints) list.push_back({c.residual, -1, 0, c.derivative, c.from});
  return list;
}

/// A label in which "(6*)", no equation of the user, is replaced by the combination that it stands for.
std::string in_given_equations(std::string label, const Model& repaired) {
  constexpr int deepest = 3;  // combinations of combinations; an equation may have been replaced twice
  for (int depth = 0; depth < deepest && label.find("*)") != std::string::npos; ++depth)
    for (std::size_t i = 0; i < repaired.residuals.size(); ++i) {
      const auto [block, row] = repaired.origin[i];
      const auto& how = repaired.blocks[block].rewritten;
      if (static_cast<std::size_t>(row) >= how.size() || how[row].empty()) continue;
      const std::string star = repaired.label(i), &note = how[row];
      const std::string meaning = label == star ? note : "(" + note + ")";
      for (std::size_t k = 0; (k = label.find(star, k)) != std::string::npos; k += meaning.size())
        label.replace(k, star.size(), meaning);
    }
  return label;
}

/// The conditions of a repaired model, in the unknowns and equations of the original one.
std::vector<Constraint> in_given_terms(std::vector<Constraint> list, const Repaired& repaired) {
  for (Constraint& c : list) {
    c.residual = substitute(c.residual, repaired.definitions);
    std::string label = in_given_equations(c.label, *repaired.model);
    if (label != c.label) c.origin = -1, c.label = std::move(label);
  }
  std::stable_sort(list.begin(), list.end(), [](const Constraint& a, const Constraint& b) {
    return display_width(a.label) < display_width(b.label);  // an equation as written, then combinations
  });
  return list;
}

std::vector<Constraint> repaired_constraints(const Repaired& repaired) {
  const Model& m = *repaired.model;
  return in_given_terms(conditions_by_offsets(m, require_regular(m)), repaired);
}

Truth from_array(const ModelPtr& model, const Analysis& a, const ArrayResult& array) {
  Truth t;
  t.index = array.index;
  t.dof = array.dof;
  t.by =
      array.exact ? "derivative array, exact" : text("derivative array, ranks at ", array.points, " points");
  if (a.regular && a.dof == array.dof) return t;
  t.found = array_constraints(array);
  t.complete = static_cast<int>(t.found.size()) == array.conditions;
  const bool leads_further = !t.complete && repair(model);
  t.conditions = leads_further ? Truth::Conditions::of_repaired : Truth::Conditions::found;
  return t;
}

[[noreturn]] void no_road(const Model& m, const Analysis& a, const ArrayResult* array,
                          const std::vector<std::string>& tried) {
  std::string why = why_not_regular(m, a);
  if (array) why += "\n  derivative array: " + array->text;
  for (const std::string& line : tried) why += "\n  " + line;
  throw Failure("no index can be given: " + why);
}

/// det J is written out, and no factor of it can vanish.
bool regular_everywhere(const Model& m, const Analysis& a) {
  const Validity v = validity(m, a, blocks_of(m, a));
  return v.complete && v.conditions.empty();
}

/// The structure's answer, and at which points it was confirmed.
Truth confirmed_structure(const Model& m, const Analysis& a) {
  const auto n = static_cast<int>(m.variables.size());
  std::string by = "structure, system Jacobian regular";
  if (a.solutions && a.solutions->most == n)
    by += ", also at a consistent point";
  else if (a.solutions)
    by += "; no consistent point was found to confirm it";
  else if (n > OnSolutions::affordable && regular_everywhere(m, a))
    by += " at every point";
  else if (n > OnSolutions::affordable)
    by += text("; not confirmed at consistent points (more than ", OnSolutions::affordable, " equations)");
  Truth t = from_structure(a, by);
  t.index_is_bound = a.index > 1;
  return t;
}

Truth without_regular_structure(const ModelPtr& model, const Analysis& a, const ArrayResult& array) {
  if (array.verdict == ArrayVerdict::determined) return from_array(model, a, array);
  std::vector<std::string> tried;
  const auto repaired = repair(model, &tried);
  if (!repaired || array.verdict != ArrayVerdict::not_covered) no_road(*model, a, &array, tried);
  Truth t = from_structure(require_regular(*repaired->model), "structure of the repaired equations");
  t.conditions = Truth::Conditions::of_repaired;
  t.index = repaired->differentiations;
  t.index_is_bound = true;
  return t;
}

Truth find(const Model& m, const Analysis& a) {
  // A reduced form: made regular on purpose, with conditions its equations do not know, or with states that
  // are changed where it becomes singular.
  if (!m.invariants.empty() || (m.form == "dummy" && a.regular)) {
    if (!a.regular) no_road(m, a, nullptr, {});
    return from_structure(a, "structure of a reduced form, system Jacobian regular");
  }
  if (a.standing == Standing::unmatched) no_road(m, a, nullptr, {});
  if (auto t = from_pencil(m)) return *t;
  if (a.regular && m.variables.size() > array_affordable) return confirmed_structure(m, a);
  if (const int points = a.regular ? points_of_agreement(m, a) : 0)
    return from_structure(a, text("structure and derivative array, ranks at ", points, " points"));
  const auto model = std::make_shared<const Model>(m);
  ArrayOptions options;
  options.conditions = !a.regular;  // else they are those of the structure
  const ArrayResult array = derivative_array(m, options);
  if (!a.regular) return without_regular_structure(model, a, array);
  if (array.verdict == ArrayVerdict::determined && array.dof == a.dof && array.index <= a.index)
    return from_array(model, a, array);
  Truth t = confirmed_structure(m, a);
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

Consistency written_down(const Model& m, const Analysis& a, const Truth& t) {
  if (t.conditions == Truth::Conditions::found) return {t.found, t.complete};
  if (t.conditions == Truth::Conditions::by_offsets) return {conditions_by_offsets(m, a), true};
  const auto repaired = repair(std::make_shared<const Model>(m));
  if (!repaired) return {t.found, t.complete};
  return {repaired_constraints(*repaired), true};
}

/// Conditions on the states only, as many as there are; where elimination does not lead to them, the list
/// stays as it was found and is marked incomplete.
void complete_constraints(const Model& m, const Analysis& a, const Truth& t, Consistency& known) {
  const int wanted = static_cast<int>(m.states().size()) - t.dof;
  const bool clean = on_states_only(m, known.constraints);
  if (clean && static_cast<int>(known.constraints.size()) == wanted) return void(known.complete = true);
  const int order = std::max(t.index - 1, 0);
  Model there = m;
  if (a.standing == Standing::at_values) there.residuals = residuals_at_values(m);
  auto rows = a.regular ? rows_by_offsets(there, a.offsets) : rows_up_to(there, order);
  auto found = state_conditions(there, m.states(), std::move(rows), wanted);
  if (!a.regular)  // the repaired equations may lead further, or to something shorter
    if (const auto repaired = repair(std::make_shared<const Model>(there))) {
      auto more = state_conditions(*repaired->model, m.states(),
                                   rows_by_offsets(*repaired->model, repaired->offsets), wanted);
      if (more.size() > found.size() || (more.size() == found.size() && length_of(more) < length_of(found)))
        found = in_given_terms(std::move(more), *repaired);
    }
  known.complete = static_cast<int>(found.size()) == wanted;
  if (known.complete || !clean) known.constraints = std::move(found);
}

std::string answer_in(const Model& m) {
  try {
    const Truth t = find(m, analyse(m));
    return text("index ", t.index_is_bound ? "at most " : "", t.index, ", ", t.dof,
                t.dof == 1 ? " free initial value" : " free initial values");
  } catch (const UserFacing&) {
    return "no index";
  }
}

/// Notes where the regions of a piecewise model do not all have one answer.
void compare_regions(const Model& m, Truth& t) {
  if (m.variables.size() > array_affordable) return;
  std::vector<std::string> answers, words;
  for (const Region& r : regions(m)) {
    const std::string answer = answer_in(r.model);
    words.push_back(answer + " where " + r.where);
    if (std::find(answers.begin(), answers.end(), answer) == answers.end()) answers.push_back(answer);
  }
  if (answers.size() > 1) t.notes.push_back("the model is piecewise: " + join(words, "; "));
}

struct Outcome {
  std::optional<Truth> truth;
  std::string failure;
};

constexpr std::size_t kept = 500;  // equations; beyond them the structure decides, and quickly

}  // namespace

Truth truth(const Model& m, const Analysis& a) {
  static Remembered<Outcome> remembered;
  if (m.residuals.size() > kept) return find(m, a);
  auto key = key_of(m);
  const Outcome* known = remembered.find(key);
  if (!known) {
    Outcome outcome;
    try {
      outcome.truth = find(m, a);
      if (m.invariants.empty()) compare_regions(m, *outcome.truth);
    } catch (const Failure& e) {
      outcome.failure = e.what();
    }
    known = &remembered.keep(std::move(key), std::move(outcome));
  }
  if (!known->truth) throw Failure(known->failure);
  return *known->truth;
}

Truth truth(const Model& m) { return truth(m, analyse(m)); }

Consistency consistency(const Model& m) {
  static Remembered<Consistency> remembered;
  const Analysis a = analyse(m);
  const Truth t = truth(m, a);
  if (m.residuals.size() > kept) return written_down(m, a, t);
  auto key = key_of(m);
  if (const Consistency* known = remembered.find(key)) return *known;
  Consistency found = written_down(m, a, t);
  if (m.invariants.empty()) complete_constraints(m, a, t, found);
  return remembered.keep(std::move(key), std::move(found));
}

}  // namespace pendula::dae
