// Form "project": an index-0 or index-1 form whose solution is moved back onto the
// invariants after every step.
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/array_points.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/regularise.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

std::vector<Expr> states_in(std::span<const Expr> residuals, const Model& m) {
  const auto states = m.states(), inside = leaves(residuals);
  const std::unordered_set<Expr> set(inside.begin(), inside.end());
  std::vector<Expr> found;
  for (Expr x : states)
    if (set.count(x)) found.push_back(x);
  return found;
}

Projection stage(std::vector<Expr> residuals, std::vector<Expr> unknowns) {
  Projection p;
  p.jacobian = sparse_jacobian(residuals, unknowns);
  p.residuals = std::move(residuals);
  p.unknowns = std::move(unknowns);
  return p;
}

bool independent(const Projection& p) {
  const auto rows = static_cast<int>(p.residuals.size());
  return generic_rank(p.jacobian, rows, static_cast<int>(p.unknowns.size()), p.residuals).rank == rows;
}

/// For mechanisms, all coordinates (velocities) are corrected, in the norm of the mass matrix.
void weigh(Projection& p, const Model& m) {
  if (!m.mechanics || p.unknowns.empty()) return;
  const VecX& q = m.mechanics->q;
  const auto states = m.states();
  const std::unordered_set<Expr> known(states.begin(), states.end());
  for (int order : {0, 1}) {
    std::vector<Expr> all;
    for (Expr leaf : q) all.push_back(derivative_leaf(leaf, order));
    const std::unordered_set<Expr> coordinates(all.begin(), all.end());
    const auto in = [](const std::unordered_set<Expr>& set) {
      return [&](Expr x) { return set.count(x) > 0; };
    };
    const bool ours = std::all_of(all.begin(), all.end(), in(known)) &&
                      std::all_of(p.unknowns.begin(), p.unknowns.end(), in(coordinates));
    if (!ours) continue;
    p = stage(p.residuals, all);
    p.weight = m.mechanics->M;
    return;
  }
}

/// The units of all leaves as derived from the equations; 1 if all are near 1.
std::unordered_map<Expr, double> units(const Model& m) {
  constexpr std::size_t most = 300;  // rows: derivatives of linear solutions cost the square of them
  if (m.residuals.size() > most) return {};
  const NumericArray equations(DerivativeArray(residuals_at_values(m), m.variables));
  std::unordered_map<Expr, double> size;
  for (std::size_t j = 0; j < equations.columns().size(); ++j)
    size[equations.columns()[j]] = equations.unit()[j];
  return size;
}

/// Makes the minimal correction independent of units by measuring every state in its own.
void weigh_by_units(Projection& p, const std::unordered_map<Expr, double>& size) {
  std::vector<double> unit;
  for (Expr x : p.unknowns) unit.push_back(size.count(x) ? size.at(x) : 1);
  if (std::all_of(unit.begin(), unit.end(), [](double s) { return s == 1; })) return;
  for (std::size_t j = 0; j < unit.size(); ++j)
    p.weight.push_back({static_cast<int>(j), static_cast<int>(j), Expr(1 / (unit[j] * unit[j]))});
}

/// One stage per order of differentiation, each correcting states that no earlier stage has corrected; a
/// single stage if that is impossible.
std::vector<Projection> stages(const Model& m) {
  std::vector<Projection> list;
  std::unordered_set<Expr> moved;
  std::vector<Expr> all;
  int highest = 0;
  for (const Constraint& c : m.invariants) highest = std::max(highest, c.derivative);
  for (int k = 0; k <= highest; ++k) {
    std::vector<Expr> residuals;
    for (const Constraint& c : m.invariants)
      if (c.derivative == k) {
        residuals.push_back(c.residual);
        all.push_back(c.residual);
      }
    if (residuals.empty()) continue;
    std::vector<Expr> unknowns = states_in(residuals, m);
    std::erase_if(unknowns, [&](Expr x) { return moved.count(x) > 0; });
    list.push_back(stage(std::move(residuals), unknowns));
    moved.insert(unknowns.begin(), unknowns.end());
  }
  if (!std::all_of(list.begin(), list.end(), independent)) list = {stage(all, states_in(all, m))};
  const auto size = units(m);
  for (Projection& p : list) {
    weigh(p, m);
    if (p.weight.empty()) weigh_by_units(p, size);
  }
  return list;
}

Mat weights(const Projection& p, const std::unordered_map<Expr, double>& values) {
  const auto n = static_cast<Index>(p.unknowns.size());
  if (p.weight.empty()) return Mat::Identity(n, n);
  std::vector<Expr> entries;
  for (const Entry& e : p.weight) entries.push_back(e.value);
  const auto numbers = pendula::evaluate(entries, values);
  Mat W = Mat::Zero(n, n);
  for (std::size_t k = 0; k < numbers.size(); ++k) W(p.weight[k].row, p.weight[k].column) = numbers[k];
  return W;
}

/// The minimal step with G + J dx = 0: [W Jᵀ; J 0] [dx; λ] = [0; -G].
Vec least_step(const Projection& p, const std::unordered_map<Expr, double>& values, const Vec& G) {
  const auto n = static_cast<Index>(p.unknowns.size()), m = static_cast<Index>(p.residuals.size());
  Mat K = Mat::Zero(n + m, n + m);
  K.topLeftCorner(n, n) = weights(p, values);
  std::vector<Expr> slopes;
  for (const Entry& e : p.jacobian) slopes.push_back(e.value);
  const auto numbers = pendula::evaluate(slopes, values);
  for (std::size_t k = 0; k < numbers.size(); ++k)
    K(n + p.jacobian[k].row, p.jacobian[k].column) = K(p.jacobian[k].column, n + p.jacobian[k].row) =
        numbers[k];
  Vec right = Vec::Zero(n + m);
  right.tail(m) = -G;
  if (!K.allFinite() || !right.allFinite()) return Vec::Constant(n, NAN);
  return Vec(Eigen::CompleteOrthogonalDecomposition<Mat>(K).solve(right)).head(n);
}

}  // namespace

ModelPtr reduce_project(const ModelPtr& given) {
  if (!given->projections.empty()) return given;
  const ModelPtr model = regular_form(given);
  ModelPtr inner;
  std::string why;
  try {
    inner = reduce_ode(model);
  } catch (const Error& e) {
    inner = reduce_acc(model);
    why = e.what();
  }
  if (inner->invariants.empty())
    refuse_form("project", *model,
                "no constraint that could drift, so that there is nothing to project onto");
  auto done = std::make_shared<Model>(*inner);
  done->parent = inner;
  done->form = "project";
  done->drift = DriftLaw::none;
  done->projections = stages(*inner);
  done->trace.clear();
  if (!why.empty())
    done->trace.push_back("project: the accelerations stay implicit (form \"acc\"), because " + why);
  for (const Projection& p : done->projections) {
    const std::string names = grouped_names(p.unknowns);
    const bool several = names.find(", ") != std::string::npos;
    done->trace.push_back(text("project: after every step ", names, several ? " move" : " moves",
                               " as little as possible",
                               !p.weight.size()   ? ""
                               : inner->mechanics ? ", measured with the mass matrix,"
                                                  : ", each measured in its own unit,",
                               " until ", formula("0 = ", ref(column(p.residuals)))));
  }
  done->trace.push_back("     The constraints are kept to rounding, so nothing drifts.");
  return done;
}

double project(const Model& model, std::unordered_map<Expr, double>& values) {
  constexpr int most_steps = 30;  // of Newton's method: 26 halve a double root down to √ε
  double largest = 0;
  for (const Projection& p : model.projections) {
    bool done = false;
    for (int k = 0; k < most_steps && !done; ++k) {
      const auto residuals = pendula::evaluate(p.residuals, values);
      const Vec G = Eigen::Map<const Vec>(residuals.data(), static_cast<Index>(residuals.size()));
      const Vec step = least_step(p, values, G);
      if (!step.allFinite()) break;
      double size = 0;
      for (std::size_t j = 0; j < p.unknowns.size(); ++j) {
        double& x = values[p.unknowns[j]];
        x += step[j];
        size = std::max(size, std::fabs(x));
      }
      const double move = step.size() ? step.cwiseAbs().maxCoeff() : 0;
      largest = std::max(largest, move);
      // corrections of badly scaled constraints stay at the level of their rounding errors
      const double rounding = k < 4 ? 1e-14 : 1e-11;
      done = move <= rounding * (1 + size);
    }
    if (!done)
      throw Failure(text("the state could not be projected onto 0 = ", column_text(column(p.residuals)),
                         ": it is too far away, or the constraints are singular there"));
  }
  return largest;
}

}  // namespace pendula::dae
