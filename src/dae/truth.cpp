#include "dae/truth.hpp"

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/conversion.hpp"
#include "dae/derivative_array.hpp"
#include "dae/pencil.hpp"
#include "dae/rank.hpp"
#include "dae/start.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t array_affordable =
    12;  // unknowns of a nonlinear model for which numeric ranks are taken

Truth from_structure(const Analysis& a, const std::string& by) {
  Truth t;
  t.index = a.index;
  t.dof = a.dof;
  t.constraints = a.constraints;
  t.by = by;
  return t;
}

std::optional<Truth> from_pencil(const Model& m) {
  const auto form = linear_form(m);
  if (!form) return {};
  LinearIndex linear = linear_index(*form);
  if (!linear.regular)
    throw Failure(text(
        "the pencil sE - A is singular (det(sE - A) = 0 for every s): the equations depend on each other or "
        "leave unknowns open, so there is no index; sys:pencil() shows which"));
  Truth t;
  t.index = linear.index;
  t.dof = linear.dof;
  t.constraints = std::move(linear.constraints);
  t.by = "shuffle algorithm, exact";
  return t;
}

std::vector<Constraint> array_constraints(const ArrayResult& array) {
  std::vector<Constraint> list;
  for (const ArrayCondition& c : array.constraints) list.push_back({c.residual, 0, 0, c.derivative, c.from});
  return list;
}

/// The conditions of a repaired model, in the unknowns of the original one.
std::vector<Constraint> repaired_constraints(const Repaired& repaired) {
  std::vector<Constraint> list = require_regular(*repaired.model).constraints;
  for (Constraint& c : list) c.residual = substitute(c.residual, repaired.definitions);
  return list;
}

Truth from_array(const ModelPtr& model, const Analysis& a, const ArrayResult& array) {
  Truth t;
  t.index = array.index;
  t.dof = array.dof;
  t.by =
      array.exact ? "derivative array, exact" : text("derivative array, ranks at ", array.points, " points");
  if (a.regular && a.dof == array.dof) {
    t.constraints = a.constraints;
    return t;
  }
  t.constraints = array_constraints(array);
  t.complete = static_cast<int>(t.constraints.size()) == array.conditions;
  if (t.complete) return t;
  if (const auto repaired = repair(model)) {
    t.constraints = repaired_constraints(*repaired);
    t.complete = true;
  }
  return t;
}

/// A start near the `attempt`-th random values; what has no value is random too.
StartRequest random_start(const Model& m, int attempt) {
  std::vector<Expr> unknowns = m.states();
  const auto z = m.algebraic();
  unknowns.insert(unknowns.end(), z.begin(), z.end());
  std::vector<Expr> all = unknowns;
  all.insert(all.end(), m.parameters.begin(), m.parameters.end());
  for (Expr u : m.inputs)
    for (int k = 0; k <= 4; ++k) all.push_back(derivative_leaf(u, k));
  const auto value = random_point(all, attempt);
  StartRequest request;
  request.t = 0.7;
  for (Expr leaf : unknowns) request.guess.push_back({leaf, value.at(leaf)});
  for (Expr p : m.parameters)
    if (!m.values.count(p)) request.parameters[p] = Expr(value.at(p));
  for (Expr leaf : all)
    if (symbol_of(leaf).kind == pendula::Kind::input) request.inputs[leaf] = Expr(value.at(leaf));
  return request;
}

/// Is the system Jacobian regular at some consistent point? Then offsets, degrees of freedom and the bound on
/// the index are right (Pryce 2001, Thm 4.2). It can be regular almost everywhere and yet singular wherever
/// the equations hold. Nothing if no point was found.
std::optional<bool> regular_on_solutions(const ModelPtr& model, const Analysis& a) {
  std::optional<bool> answer;
  const auto n = static_cast<Eigen::Index>(model->variables.size());
  for (int attempt = 0; attempt < 4 && answer != true; ++attempt) try {
      const StartRequest request = random_start(*model, attempt);
      const StartPtr at = init(model, request);
      Mat J = Mat::Zero(n, n);
      for (const Entry& e : a.jacobian) J(e.row, e.column) = (*at)(substitute(e.value, request.inputs));
      if (J.allFinite()) answer = numeric_rank(J) == n;
    } catch (const UserFacing&) {
      continue;  // no consistent point from here
    }
  return answer;
}

[[noreturn]] void no_road(const Model& m, const Analysis& a, const ArrayResult* array,
                          const std::vector<std::string>& tried) {
  const auto n = m.variables.size();
  std::string why =
      a.offsets.unmatched.empty()
          ? text("the system Jacobian is identically singular (rank ", a.rank.rank, " of ", n,
                 "), so the structural index ", a.offsets.index(), " would be wrong")
          : "the model is structurally singular: sys:structure() names the over- and under-determined parts";
  if (array) why += "\n  derivative array: " + array->text;
  for (const std::string& line : tried) why += "\n  " + line;
  throw Failure("no index can be given: " + why);
}

}  // namespace

Truth truth(const Model& m, const Analysis& a) {
  if (!m.invariants
           .empty()) {  // a reduced form: made regular on purpose, with conditions its equations do not know
    if (!a.regular) no_road(m, a, nullptr, {});
    return from_structure(a, "structure of a reduced form, system Jacobian regular");
  }
  if (auto t = from_pencil(m)) return *t;
  const auto model = std::make_shared<const Model>(m);
  const bool small = m.variables.size() <= array_affordable;
  if (!a.regular || small) {
    const ArrayResult array = derivative_array(m);
    const bool determined = array.verdict == ArrayVerdict::determined;
    if (a.regular && (!determined || array.dof != a.dof || array.index > a.index)) {
      // The array may have met a singular branch of the solutions; the structure is right if it is so at one
      // point.
      if (!determined || regular_on_solutions(model, a).value_or(true))
        return from_structure(a, "structure, system Jacobian regular, also at consistent points");
    }
    if (determined) return from_array(model, a, array);
    if (!a.regular) {
      std::vector<std::string> tried;
      const auto repaired = repair(model, &tried);
      if (!repaired || array.verdict != ArrayVerdict::not_covered) no_road(m, a, &array, tried);
      Truth t = from_structure(require_regular(*repaired->model), "structure of the repaired equations");
      t.constraints = repaired_constraints(*repaired);
      t.index = repaired->differentiations;
      t.index_is_bound = true;
      return t;
    }
  }
  Truth t = from_structure(a, "structure, system Jacobian regular");
  t.index_is_bound = a.index > 1;
  return t;
}

Truth truth(const Model& m) { return truth(m, analyse(m)); }

}  // namespace pendula::dae
