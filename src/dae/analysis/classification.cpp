#include "dae/analysis/classification.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/structure/balance.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

bool has_calls(const std::vector<Expr>& list) {
  const auto nodes = topological(list);
  return std::any_of(nodes.begin(), nodes.end(),
                     [](Expr e) { return !e.is_constant() && !e.is_symbol() && e.op() == Op::call; });
}

bool contains(Expr e, const std::unordered_set<Expr>& set) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return set.count(leaf) > 0; });
}

/// The rows without x′, and those of them without z.
struct AlgebraicRows {
  std::vector<int> all, without_z;
};

AlgebraicRows algebraic_rows(const Model& m) {
  const auto top = m.top_derivatives(), z = m.algebraic();
  const std::unordered_set<Expr> derivatives(top.begin(), top.end()), algebraic(z.begin(), z.end());
  AlgebraicRows rows;
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    if (contains(m.residuals[i], derivatives)) continue;
    rows.all.push_back(static_cast<int>(i));
    if (!contains(m.residuals[i], algebraic)) rows.without_z.push_back(static_cast<int>(i));
  }
  return rows;
}

/// Is the model x′ = f, 0 = g, in whatever way it is written?
bool is_semi_explicit(const Model& m) {
  return !m.algebraic().empty() && m.kind != dae::ModelKind::ode && !m.mass_matrix &&
         solved_rows(m).size() == m.top_derivatives().size();
}

/// Semi-explicit models have index 1 exactly where ∂g/∂z is regular and, if g = g(x), index 2 exactly where
/// ∂g/∂x ∂f/∂z is.
bool condition_is_sharp(const Model& m, const Analysis& a) {
  return is_semi_explicit(m) && a.offsets.index() <= 2;
}

std::string functions_text(const Model& m, const Analysis& a, const DeterminantFactors& v) {
  const int index = a.offsets.index();
  const AlgebraicRows rows = algebraic_rows(m);
  std::string where = conditions_text(v, DeterminantFactor::Kind::functions);
  const bool written = !where.empty() && v.complete;
  if (!written) {
    std::vector<int> z;
    for (std::size_t j = 0; j < m.variables.size(); ++j)
      if (m.variables[j].order == 0) z.push_back(static_cast<int>(j));
    const std::string g = equation_list(m, rows.all);
    const bool hessenberg = is_semi_explicit(m) && index == 2 && rows.without_z.size() == rows.all.size();
    where = !is_semi_explicit(m) && index <= 1
                ? z.empty() ? "∂F/∂x′ is nonsingular" : "∂F/∂(x′, z) is nonsingular"
            : index == 1 ? text("∂(", g, ")/∂(", unknown_list(m, z), ") is nonsingular")
            : hessenberg ? text("∂g/∂x ∂f/∂z is nonsingular, with x′ = f and 0 = g the equations ", g)
                         : "the system Jacobian is nonsingular";
  }
  std::string line = text("index ", index, " where ", where);
  if (condition_is_sharp(m, a))
    line += written ? text("; where ", v.conditions.size() == 1 ? "it" : "one of them",
                           " vanishes identically, the index is at least ", index + 1)
                    : text("; where it is singular everywhere, the index is at least ", index + 1);
  return line;
}

}  // namespace

std::vector<std::string> condition_lines(const Model& m, const Analysis& a, const DeterminantFactors& v) {
  std::vector<std::string> lines;
  const auto any = [&](DeterminantFactor::Kind kind) {
    return std::any_of(v.conditions.begin(), v.conditions.end(),
                       [&](const DeterminantFactor& c) { return c.kind == kind; });
  };
  if (any(DeterminantFactor::Kind::functions) || (!v.complete && has_calls(m.residuals)))
    lines.push_back(functions_text(m, a, v));
  const std::string parameters = conditions_text(v, DeterminantFactor::Kind::parameters),
                    state = conditions_text(v, DeterminantFactor::Kind::state);
  if (!parameters.empty() || !state.empty())
    lines.push_back("the structural answer holds where " + parameters +
                    (parameters.empty() || state.empty() ? "" : ", ") + state);
  std::vector<std::string> reached;
  bool none = false;
  for (const DeterminantFactor& c : v.conditions) {
    if (c.reached == true) reached.push_back(to_text(c.factor) + " = 0");
    none = none || c.reached == false;
  }
  if (reached.empty() && none) lines.back() += "; no consistent point where that fails was found";
  if (!reached.empty())
    lines.push_back(text("singular points: there are consistent points with ",
                         join(reached, " and others with "), "; the index changes there"));
  return lines;
}

std::vector<std::pair<std::string, std::string>> classification(const Model& m) {
  std::vector<std::pair<std::string, std::string>> rows;
  if (m.residuals.size() != m.variables.size() || !has_calls(m.residuals)) return rows;
  const Analysis a = analyse(m);
  if (a.jacobian_status == JacobianStatus::unmatched) return rows;
  const AlgebraicRows g = algebraic_rows(m);
  if (!is_semi_explicit(m) && a.offsets.index() > 1) return rows;
  if (is_semi_explicit(m) && !g.without_z.empty()) {
    const std::string names = equation_list(m, g.without_z);
    const bool one = g.without_z.size() == 1;
    rows.push_back(
        {"∂g/∂z", text(names, one ? " does" : " do", " not contain the algebraic variables: ∂g/∂z is ",
                       "rank deficient, so the index is at least 2")});
  }
  if (a.jacobian_status != JacobianStatus::identically)
    for (const std::string& line : condition_lines(m, a, determinant_factors(m, a, blocks_of(m, a))))
      rows.push_back({"holds", line});
  std::vector<std::string> conditions;
  for (const Constraint& c : hidden_constraints_by_offsets(m, a))
    conditions.push_back("0 = " + to_text(c.residual));
  if (!conditions.empty()) rows.push_back({"consistency", join(conditions, ", ")});
  return rows;
}

}  // namespace pendula::dae
