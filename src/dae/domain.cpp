#include "dae/domain.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/balance.hpp"
#include "dae/elided.hpp"
#include "dae/lineage.hpp"
#include "dae/rank.hpp"
#include "dae/reduce.hpp"
#include "dae/remembered.hpp"
#include "dae/validity.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

struct Factor {
  Nonzero what;
  bool
      reached;  ///< false: no state that satisfies the constraints makes it 0 at the model's parameter values
};

/// Is there a state with factor = 0 that satisfies what the equations demand of states (and z)? Other than
/// for consistent points, derivatives need not exist there: in x x′ = -1 they grow without bound on the way
/// to x = 0. Gauss–Newton from a few points.
bool reachable(const Model& m, const Analysis& a, Expr factor) {
  std::vector<Expr> rows{factor};
  for (const Constraint& c : conditions_by_offsets(m, a)) rows.push_back(c.residual);
  const auto top = m.top_derivatives();
  for (Expr e : m.residuals) {
    const auto inside = leaves({&e, 1});
    if (std::none_of(inside.begin(), inside.end(),
                     [&](Expr leaf) { return std::find(top.begin(), top.end(), leaf) != top.end(); }))
      rows.push_back(e);
  }
  rows = at_values(rows, m.values);
  std::vector<Expr> unknowns;
  for (Expr leaf : leaves(rows)) {
    const auto kind = symbol_of(leaf).kind;
    if (kind != pendula::Kind::parameter && kind != pendula::Kind::constant) unknowns.push_back(leaf);
  }
  const std::vector<Entry> slopes = sparse_jacobian(rows, unknowns);
  std::vector<Expr> outputs = rows;
  for (const Entry& e : slopes) outputs.push_back(e.value);
  const auto n = static_cast<Eigen::Index>(rows.size()), k = static_cast<Eigen::Index>(unknowns.size());
  for (int seed = 0; seed < 8; ++seed) {
    auto point = random_point(outputs, seed);
    for (int iteration = 0; iteration < 60; ++iteration) {
      const auto numbers = pendula::evaluate(outputs, point);
      const Vec r = Eigen::Map<const Vec>(numbers.data(), n);
      Mat J = Mat::Zero(n, k);
      for (std::size_t s = 0; s < slopes.size(); ++s)
        J(slopes[s].row, slopes[s].column) = numbers[static_cast<std::size_t>(n) + s];
      if (!r.allFinite() || !J.allFinite()) break;
      const Vec step = Eigen::CompleteOrthogonalDecomposition<Mat>(J).solve(-r);
      double size = 0;
      for (Eigen::Index j = 0; j < k; ++j)
        size = std::max(size, std::fabs(point[unknowns[static_cast<std::size_t>(j)]] += step[j]));
      if (r.cwiseAbs().maxCoeff() < 1e-9 && step.norm() <= 1e-6 * (1 + size)) return true;
    }
  }
  return false;
}

/// "(1), (3) no longer determine x′, z"
std::string loss(const Model& m, const Offsets& o, const Condition& c) {
  std::vector<Expr> lost;
  for (int j : c.columns) {
    const auto k = static_cast<std::size_t>(j);
    lost.push_back(derivative_leaf(m.variables[k].leaf, o.d[k]));
  }
  return text(equation_list(m, c.rows),
              c.rows.size() == 1 ? " no longer determines " : " no longer determine ", grouped_names(lost));
}

std::vector<Factor> singular_factors(const ModelPtr& written) {
  static Remembered<std::vector<Factor>> known;
  const auto key = key_of(*written);
  if (const auto* found = known.find(key)) return *found;
  const ModelPtr source = regular_form(written);
  std::vector<Factor> list;
  if (source->residuals.size() == source->variables.size()) {
    const Analysis a = analyse(*source);
    if (a.regular)
      for (const Condition& c : validity(*source, a, blocks_of(*source, a)).conditions)
        if (c.kind == Condition::Kind::state)
          list.push_back({{c.factor, loss(*source, a.offsets, c), ""},
                          c.reached != false || reachable(*source, a, c.factor)});
  }
  return known.keep(key, list);
}

}  // namespace

std::vector<Nonzero> domain(const ModelPtr& model, bool all) {
  std::vector<Nonzero> list = model->domain;
  for (const Factor& f : singular_factors(original(model))) {
    if (!f.reached && !all) continue;
    Nonzero n = f.what;
    n.factor = resolve(*model, n.factor);
    const bool known =
        std::any_of(list.begin(), list.end(), [&](const Nonzero& other) { return other.factor == n.factor; });
    if (!known) list.push_back(std::move(n));
  }
  return list;
}

std::string domain_text(const Model& m) {
  std::vector<std::string> words;
  for (const Nonzero& n : m.domain) words.push_back(elided_text(n.factor) + " ≠ 0");
  return join(words, ", ");
}

void require_domain(const Model& m, const std::unordered_map<Expr, double>& values) {
  for (const Nonzero& n : m.domain) {
    const auto inside = leaves({&n.factor, 1});
    const bool known = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return values.count(leaf) || symbol_of(leaf).kind == pendula::Kind::constant;
    });
    if (!known) continue;
    const double g = pendula::evaluate({&n.factor, 1}, values)[0];
    if (std::fabs(g) > 1e-14) continue;
    throw Error(text(elided_text(n.factor), " = 0 at the start, and ", n.where,
                     n.remedy.empty() ? "" : "; " + n.remedy, ". reduce(\"", m.form,
                     "\", { at = sys:init{ … } }) chooses by a start"));
  }
}

}  // namespace pendula::dae
