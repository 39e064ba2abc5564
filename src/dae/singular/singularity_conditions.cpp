#include "dae/singular/singularity_conditions.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/balance.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/evaluator.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

bool has_variable(Expr e) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(),
                     [](Expr leaf) { return symbol_of(leaf).kind == Kind::variable; });
}

struct Factor {
  SingularityCondition what;
  bool reached;  ///< false: no state on the constraints makes it 0 at the model's parameter values
};

/// Is there a state with factor = 0 that satisfies all conditions on states (and on the z in the factor)?
/// In contrast to consistent points, derivatives and other z need not exist there: in x x′ = -1 and 0 = z x
/// - 1 they are unbounded for x → 0. Gauss–Newton from a few points. `accept` selects the points that
/// count; empty: all.
using Accept = std::function<bool(const std::unordered_map<Expr, double>&)>;
bool reachable(const Model& m, const Analysis& a, Expr factor, const Accept& accept = {}) {
  std::vector<Expr> rows{factor};
  for (const Constraint& c : hidden_constraints_by_offsets(m, a)) rows.push_back(c.residual);
  const auto top = m.top_derivatives();
  const std::vector<Expr> own = leaves({&factor, 1}), algebraic = m.algebraic();
  const auto contains = [](const std::vector<Expr>& list, Expr leaf) {
    return std::find(list.begin(), list.end(), leaf) != list.end();
  };
  const auto unbounded = [&](Expr leaf) {
    return contains(top, leaf) || (contains(algebraic, leaf) && !contains(own, leaf));
  };
  for (Expr e : m.residuals) {
    const auto inside = leaves({&e, 1});
    if (std::none_of(inside.begin(), inside.end(), unbounded)) rows.push_back(e);
  }
  rows = at_values(rows, m.values);
  std::vector<Expr> unknowns;
  for (Expr leaf : leaves(rows))
    if (is_varying(leaf)) unknowns.push_back(leaf);
  if (unknowns.empty()) return false;  // the factor is constant at the parameter values
  const std::vector<Entry> slopes = sparse_jacobian(rows, unknowns);
  std::vector<Expr> outputs = rows;
  for (const Entry& e : slopes) outputs.push_back(e.value);
  std::vector<Expr> all = unknowns;
  for (const auto& [leaf, value] : random_point(outputs, 0))
    if (std::find(unknowns.begin(), unknowns.end(), leaf) == unknowns.end()) all.push_back(leaf);
  const Evaluator evaluate(outputs, all);
  const auto n = static_cast<Eigen::Index>(rows.size()), k = static_cast<Eigen::Index>(unknowns.size());
  constexpr int patience = 12;                          // iterations without progress
  constexpr double progress = 0.9;                      // of the residual
  constexpr double satisfied = 1e-9, converged = 1e-6;  // Newton's next step is the square, 10⁻¹²
  for (int seed = 0; seed < 8; ++seed) {
    auto point = random_point(outputs, seed);
    std::vector<double> w;
    for (Expr leaf : all) w.push_back(point[leaf]);
    double least = INFINITY;
    for (int iteration = 0, last = 0; iteration < 60 && iteration - last <= patience; ++iteration) {
      const auto numbers = evaluate(w);
      const Vec r = Eigen::Map<const Vec>(numbers.data(), n);
      Mat J = Mat::Zero(n, k);
      for (std::size_t s = 0; s < slopes.size(); ++s) J(slopes[s].row, slopes[s].column) = numbers[n + s];
      if (!r.allFinite() || !J.allFinite()) break;
      const Vec step = Eigen::CompleteOrthogonalDecomposition<Mat>(J).solve(Vec(-r));
      Eigen::Map<Vec> moved(w.data(), k);
      moved += step;
      if (const double size = r.norm(); size < progress * least) {
        least = size;
        last = iteration;
      }
      if (r.cwiseAbs().maxCoeff() < satisfied &&
          step.norm() <= converged * (1 + moved.cwiseAbs().maxCoeff())) {
        for (std::size_t j = 0; j < unknowns.size(); ++j) point[unknowns[j]] = w[j];
        if (!accept || accept(point)) return true;
        break;
      }
    }
  }
  return false;
}

/// "(1), (3) no longer determine x′, z"
std::string loss(const Model& m, const Offsets& o, const DeterminantFactor& c) {
  std::vector<Expr> lost;
  for (int j : c.columns) {
    const auto k = static_cast<std::size_t>(j);
    lost.push_back(derivative_leaf(m.variables[k].leaf, o.d[k]));
  }
  return text(equation_list(m, c.rows),
              c.rows.size() == 1 ? " no longer determines " : " no longer determine ", grouped_names(lost));
}

/// Coordinates that the mass matrix couples, directly or through others.
std::vector<std::vector<int>> coupled(const Mechanics& mechanics) {
  const auto n = static_cast<std::size_t>(mechanics.q.size());
  Pattern pattern(n);
  for (std::size_t i = 0; i < n; ++i) pattern[i].push_back(static_cast<int>(i));
  for (const Entry& e : mechanics.M)
    if (e.row != e.column) pattern[e.row].push_back(e.column);
  std::vector<std::vector<int>> list;  // M is symmetric: its components are strongly connected
  for (Part& part : dulmage_mendelsohn(pattern, static_cast<int>(n)).square)
    list.push_back(std::move(part.rows));
  return list;
}

/// Is there a direction without inertia that the constraints leave free: W v = 0 and ∂C/∂q v = 0?
bool floats(const Mechanics& mechanics, const ParameterValues& values,
            std::unordered_map<Expr, double> point) {
  const Eigen::Index n = mechanics.q.size(), constraints = mechanics.C.size();
  std::vector<Expr> entries;
  for (const auto* list : {&mechanics.M, &mechanics.dCdq})
    for (const Entry& e : *list) entries.push_back(e.value);
  entries = at_values(entries, values);
  for (Expr leaf : leaves(entries)) point.try_emplace(leaf, 0.0);
  const std::vector<double> numbers = pendula::evaluate(entries, point);
  Mat A = Mat::Zero(n + constraints, n);
  std::size_t k = 0;
  for (const Entry& e : mechanics.M) A(e.row, e.column) = numbers[k++];
  for (const Entry& e : mechanics.dCdq) A(n + e.row, e.column) = numbers[k++];
  return A.allFinite() && numeric_rank(A) < n;
}

/// Adds factors at which the mass matrix of a mechanism loses rank, as for aligned Euler angles or a
/// coordinate without effect: those of the determinants of coupled blocks of up to four coordinates. Up to
/// `searched` coordinates a consistent point must exist; in larger models every vanishing factor counts.
void add_mass_factors(const Model& m, const Analysis& a, std::vector<Factor>& list) {
  constexpr std::size_t most_coordinates = 4;  // of a determinant: 24 products of entries
  constexpr Eigen::Index searched = 40;        // coordinates: Gauss-Newton runs with dense Jacobians
  const Mechanics& mechanics = *m.mechanics;
  const auto n = static_cast<std::size_t>(mechanics.q.size());
  std::vector<std::vector<const Entry*>> row(n);
  for (const Entry& e : mechanics.M) row[e.row].push_back(&e);
  for (const std::vector<int>& part : coupled(mechanics)) {
    if (part.size() > most_coordinates) continue;
    const auto size = static_cast<Eigen::Index>(part.size());
    MatX W = MatX::Zero(size, size);
    bool constant = true;
    for (Eigen::Index i = 0; i < size; ++i)
      for (const Entry* e : row[part[i]]) {
        const auto j = std::lower_bound(part.begin(), part.end(), e->column) - part.begin();
        W(i, j) = e->value;
        constant = constant && !has_variable(e->value);
      }
    if (constant) continue;
    std::vector<Expr> lost;
    for (int j : part) lost.push_back(derivative_leaf(mechanics.q[j], 2));
    for (Expr f : vanishing_factors(linalg::determinant(W))) {
      const auto same = [&](const Factor& known) { return known.what.factor == f; };
      if (!has_variable(f) || std::any_of(list.begin(), list.end(), same)) continue;
      const Accept singular = [&](const auto& point) { return floats(mechanics, m.values, point); };
      const bool reached = mechanics.q.size() > searched || reachable(m, a, f, singular);
      if (!reached && reachable(m, a, f)) continue;  // a constraint determines the direction without inertia
      list.push_back({{f, "the mass matrix no longer determines " + grouped_names(lost), ""}, reached});
    }
  }
}

std::vector<Factor> singular_factors(const ModelPtr& written) {
  static ModelCache<std::vector<Factor>> known(cached_models);
  const auto key = key_of(*written);
  if (const auto* found = known.find(key)) return *found;
  const ModelPtr source = regular_form(written);
  std::vector<Factor> list;
  if (source->residuals.size() == source->variables.size()) {
    const Analysis a = analyse(*source);
    if (a.regular)
      for (const DeterminantFactor& c : determinant_factors(*source, a, blocks_of(*source, a)).conditions)
        if (c.kind == DeterminantFactor::Kind::state)
          list.push_back({{c.factor, loss(*source, a.offsets, c), ""},
                          c.reached != false || reachable(*source, a, c.factor)});
    const Model* mechanism = source.get();
    while (!mechanism->mechanics && mechanism->parent) mechanism = mechanism->parent.get();
    if (a.regular && mechanism->mechanics && mechanism->mechanics->C.size() > 0)
      add_mass_factors(*mechanism, analyse(*mechanism), list);
  }
  return known.insert(key, list);
}

}  // namespace

std::vector<SingularityCondition> singularity_conditions(const ModelPtr& model, bool all) {
  std::vector<SingularityCondition> list = model->singularity_conditions;
  for (const Factor& f : singular_factors(original(model))) {
    if (!f.reached && !all) continue;
    SingularityCondition n = f.what;
    n.factor = resolve(*model, n.factor);
    const bool known = std::any_of(list.begin(), list.end(), [&](const SingularityCondition& other) {
      return other.factor == n.factor;
    });
    if (!known) list.push_back(std::move(n));
  }
  return list;
}

std::vector<SingularityCondition> choice_conditions(const ModelPtr& model) {
  if (model->form != "array") return {};
  std::vector<SingularityCondition> list;
  const std::vector<SingularityCondition> known = singularity_conditions(model, true);
  for (const Factor& f : singular_factors(model)) {
    const auto same = [&](const SingularityCondition& c) { return c.factor == f.what.factor; };
    if (!f.reached || std::any_of(known.begin(), known.end(), same)) continue;
    SingularityCondition c = f.what;
    c.remedy =
        text("the choice of ", grouped_names(model->states()),
             " as states ends there: go on from sol:state() with ",
             "sys:reduce(\"array\", { at = sol:state() }), or take sys:reduce \"dummy\", which changes its ",
             "choice on the way");
    list.push_back(std::move(c));
  }
  return list;
}

std::string singularity_conditions_text(const Model& m) {
  std::vector<std::string> words;
  for (const SingularityCondition& n : m.singularity_conditions)
    words.push_back(truncated_text(n.factor) + " ≠ 0");
  return join(words, ", ");
}

void require_nonsingular(const Model& m, const std::unordered_map<Expr, double>& values) {
  for (const SingularityCondition& n : m.singularity_conditions) {
    const auto inside = leaves({&n.factor, 1});
    const bool known = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return values.count(leaf) || symbol_of(leaf).kind == Kind::constant;
    });
    if (!known) continue;
    const double g = pendula::evaluate({&n.factor, 1}, values)[0];
    constexpr double rounding = 1e-14;  // 45 ε, of factors of size 1
    if (std::fabs(g) > rounding) continue;
    throw Error(text(truncated_text(n.factor), " = 0 at the start, and ", n.where,
                     n.remedy.empty() ? "" : "; " + n.remedy, ". reduce(\"", m.form,
                     "\", { at = sys:init{ … } }) chooses by a start"));
  }
}

}  // namespace pendula::dae
