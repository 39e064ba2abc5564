#include "dae/report/structure_report.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/pencil/pencil_polynomial.hpp"
#include "dae/rank/rank.hpp"
#include "dae/structure/signature.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// Unknowns whose share of a unit null vector of J counts.
std::vector<std::string> null_vector_names(const StructureReport& s, const Mat& J) {
  constexpr double share = 1e-6;
  const Mat N = null_space(J);
  std::vector<std::string> names;
  for (Eigen::Index j = 0; j < N.rows(); ++j)
    if (N.row(j).norm() > share) {
      const auto at = static_cast<std::size_t>(j);
      names.push_back(to_text(derivative_leaf(s.model->variables[at].leaf, s.analysis.offsets.d[at])));
    }
  return names;
}

/// σ_n/σ_1 of the system Jacobian at a start, rows and columns scaled; nothing if it is too large.
void look_at(StructureReport& s, const ConsistentState& at) {
  constexpr std::size_t affordable = 300;
  const std::size_t n = s.model->variables.size();
  for (const Variable& v : s.model->variables)
    if (!at.value_for(*s.model, v.leaf))
      throw Error(text("start has no value for '", to_text(v.leaf),
                       "': it belongs to another model; make one with sys:init{ … }"));
  if (n > affordable) return;
  Mat J = Mat::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (const Entry& e : s.analysis.jacobian) J(e.row, e.column) = at(e.value);
  if (!J.allFinite()) return;
  double gap = 0;
  const bool regular = numeric_rank(J, &gap) == static_cast<int>(n);
  s.gap = regular ? gap : 0;
  if (!regular) s.null_vector = null_vector_names(s, J);
}

std::string answer_text(const IndexResult& t) {
  return text("index ", t.index_is_bound ? "at most " : "", t.index, ", ", t.dof,
              t.dof == 1 ? " free initial value" : " free initial values");
}

/// "index 1, 1 free initial value", or why there is none.
std::string answer_of(const Model& m) {
  try {
    return answer_text(differentiation_index(m));
  } catch (const UserFacing&) {
    return "no index";
  }
}

Model without_value(const Model& m, std::optional<Expr> p) {
  Model other = m;
  if (p)
    other.values.erase(*p);
  else
    other.values.clear();
  return other;
}

constexpr std::size_t affordable_cases = 12;  // unknowns of a model that is analysed for other values

/// Factors of det J, and for linear models those of the leading coefficient of det(sE - A), which tells more where
/// the structure fails.
std::vector<Expr> factors_that_decide(const StructureReport& s) {
  std::vector<Expr> factors;
  for (const DeterminantFactor& c : s.validity.conditions) factors.push_back(c.factor);
  try {
    const std::vector<Expr> coefficients = pencil_polynomial(*s.model);
    if (coefficients.empty()) return factors;
    for (Expr f : vanishing_factors(coefficients.back()))
      if (std::find(factors.begin(), factors.end(), f) == factors.end()) factors.push_back(f);
  } catch (const UserFacing&) {  // not linear with constant coefficients
  }
  return factors;
}

/// The model at a value of a parameter, which may contain others.
Model with_value(const Model& m, Expr p, Expr value) {
  Model there = m;
  if (value.is_constant()) {
    there.values[p] = value;
    return there;
  }
  there.values.erase(p);
  for (Expr& residual : there.residuals) residual = simplify(substitute(residual, {{p, value}}));
  return there;
}

/// What holds where one of these factors vanishes, or for all other values if the model has such values. For values that
/// the model does not have, only what differs and exists is told.
void parameter_cases(StructureReport& s) {
  constexpr std::size_t most_cases = 4;
  const Model& m = *s.model;
  if (m.variables.size() > affordable_cases) return;
  const std::string here = answer_of(m);
  std::vector<std::string> told;
  const auto tell = [&](const std::string& where, const std::string& answer, bool always) {
    const std::string line = "for " + where + ": " + answer;
    const bool new_line = std::find(told.begin(), told.end(), line) == told.end();
    if (told.size() < most_cases && new_line && (always || (answer != here && answer != "no index")))
      told.push_back(line);
  };
  for (Expr factor : factors_that_decide(s)) {
    const bool holds = at_values(std::vector<Expr>{factor}, m.values)[0].is_zero();
    for (const auto& [p, value] : exceptional_values(factor))
      if (!holds)
        tell(text(to_text(p), " = ", to_text(value)), answer_of(with_value(m, p, value)), !m.values.count(p));
      else if (at_values(std::vector<Expr>{p - value}, m.values)[0].is_zero())
        tell(text(to_text(p), " ≠ ", to_text(value)), answer_of(without_value(m, p)), m.values.count(p) > 0);
  }
  s.notes.insert(s.notes.end(), told.begin(), told.end());
}

/// Where the structure says nothing, the index may still be that of these parameter values only.
void other_values(StructureReport& s, const IndexResult& known) {
  const Model& m = *s.model;
  if (m.values.empty() || m.variables.size() > affordable_cases) return;
  try {
    const IndexResult generic = differentiation_index(without_value(m, {}));
    if (generic.index != known.index || generic.dof != known.dof)
      s.notes.push_back("for almost all other parameter values: " + answer_text(generic));
  } catch (const UserFacing&) {  // nothing can be said about them
  }
}

void find_index(StructureReport& s) {
  const Model& m = *s.model;
  try {
    const IndexResult known = differentiation_index(m, s.analysis);
    s.index = known.index;
    s.dof = known.dof;
    s.evidence = known.evidence;
    s.index_is_bound = known.index_is_bound;
    s.is_unconfirmed = known.is_unconfirmed;
    s.notes.insert(s.notes.end(), known.notes.begin(), known.notes.end());
    if (s.analysis.standing == Standing::identically) other_values(s, known);
  } catch (const Failure& e) {
    s.evidence = e.what();
  }
}

}  // namespace

StructureReport structure(const ModelPtr& model, const ConsistentStatePtr& at) {
  StructureReport s;
  s.model = model;
  const Model& m = *model;
  const auto n = static_cast<int>(m.variables.size());
  const bool square = m.residuals.size() == m.variables.size();
  if (square)
    s.analysis = analyse(m);
  else
    s.analysis.sigma = signature(m);
  if (s.analysis.standing == Standing::unmatched) {
    s.verdict = Verdict::structurally_singular;
    s.analysis.offsets.unmatched.resize(std::max<std::size_t>(1, s.analysis.offsets.unmatched.size()));
    s.blocks = dulmage_mendelsohn(incidence(m), n);
    return s;
  }
  s.structural_index = s.analysis.offsets.index();
  s.structural_dof = s.analysis.offsets.value;
  s.blocks = blocks_of(m, s.analysis);
  find_index(s);
  if (at) look_at(s, *at);
  if (s.analysis.standing == Standing::identically) {
    s.verdict = Verdict::identically_singular;
    parameter_cases(s);
    return s;
  }
  s.validity = determinant_factors(m, s.analysis, s.blocks);
  parameter_cases(s);
  if (!s.analysis.regular)
    s.verdict = Verdict::identically_singular;
  else if (s.gap && *s.gap == 0)
    s.verdict = Verdict::singular_here;
  return s;
}

}  // namespace pendula::dae
