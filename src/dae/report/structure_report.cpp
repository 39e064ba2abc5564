#include "dae/report/structure_report.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/report/parameter_cases.hpp"
#include "dae/structure/signature.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// The unknowns with a visible component in the null vector of J.
std::vector<std::string> null_vector_names(const StructureReport& s, const Mat& J) {
  const Mat N = null_space(J);
  std::vector<std::string> names;
  for (Eigen::Index j = 0; j < N.rows(); ++j)
    if (N.row(j).norm() > visible_in_null_vector) {
      const auto at = static_cast<std::size_t>(j);
      names.push_back(to_text(derivative_leaf(s.model->variables[at].leaf, s.analysis.offsets.d[at])));
    }
  return names;
}

/// Sets σ_n/σ_1 of the equilibrated system Jacobian at a start; empty for large models.
void look_at(StructureReport& s, const ConsistentState& at) {
  constexpr std::size_t affordable = 300;  // unknowns; singular values cost O(n³)
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

void add_parameter_cases(StructureReport& s) {
  const auto cases = parameter_cases(*s.model, s.validity.conditions);
  s.notes.insert(s.notes.end(), cases.begin(), cases.end());
}

/// If the structure is not decisive, the index may hold for these parameter values only.
void other_values(StructureReport& s, const IndexResult& known) {
  const Model& m = *s.model;
  if (m.values.empty() || m.variables.size() > most_unknowns_of_cases) return;
  try {
    const IndexResult generic = differentiation_index(without_values(m));
    if (generic.index != known.index || generic.dof != known.dof)
      s.notes.push_back("for almost all other parameter values: " + answer_text(generic));
  } catch (const UserFacing&) {  // no statement about other values
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
    if (s.analysis.jacobian_status == JacobianStatus::identically) other_values(s, known);
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
  if (s.analysis.jacobian_status == JacobianStatus::unmatched) {
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
  if (s.analysis.jacobian_status == JacobianStatus::identically) {
    s.verdict = Verdict::identically_singular;
    add_parameter_cases(s);
    return s;
  }
  s.validity = determinant_factors(m, s.analysis, s.blocks);
  add_parameter_cases(s);
  if (!s.analysis.regular)
    s.verdict = Verdict::identically_singular;
  else if (s.gap && *s.gap == 0)
    s.verdict = Verdict::singular_here;
  return s;
}

}  // namespace pendula::dae
