#include "integrate/event/resets.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/problem/projection.hpp"

namespace pendula::integrate {

std::vector<dae::Constraint> state_conditions(const dae::Model& model) {
  std::vector<dae::Constraint> result;
  for (const dae::Projection& stage : model.projections)
    for (Expr e : stage.residuals) result.push_back({e, 0, 0, 0, ""});
  if (result.empty()) result = model.invariants;
  const auto more = dae::hidden_constraints_by_offsets(model, dae::analyse(model));
  result.insert(result.end(), more.begin(), more.end());
  return result;
}

/// Conditions on the states, each with the scale of its residual: Σ |∂c/∂xⱼ xⱼ|.
struct Conditions {
  std::vector<Expr> list;
  codegen::Kernel residuals, sizes;

  Conditions(std::vector<Expr> conditions, const Problem& problem) : list(std::move(conditions)) {
    std::vector<Expr> terms;
    for (Expr c : list) {
      Expr size;
      const std::vector<Expr> partials = gradient(c, problem.model().x);
      for (std::size_t j = 0; j < partials.size(); ++j) size += abs(partials[j] * problem.model().x[j]);
      terms.push_back(size);
    }
    residuals = codegen::Kernel(list, problem.arguments());
    sizes = codegen::Kernel(terms, problem.arguments());
  }
  /// The violated conditions.
  std::vector<Expr> broken(const std::vector<double>& values) const {
    const std::vector<double> off = residuals(values), size = sizes(values);
    std::vector<Expr> result;
    for (std::size_t i = 0; i < off.size(); ++i)
      if (!(std::fabs(off[i]) <= 1e-7 * size[i] + 1e-12)) result.push_back(list[i]);
    return result;
  }
};

/// The conditions without those that are linearly dependent on others to first order.
static std::vector<Expr> independent(const std::vector<Expr>& conditions, const std::vector<Expr>& movable,
                                     const std::vector<double>& values, const Problem& problem) {
  std::vector<Expr> partials;
  const std::vector<Entry> entries = sparse_jacobian(conditions, movable);
  for (const Entry& e : entries) partials.push_back(e.value);
  const std::vector<double> numbers = codegen::Kernel(partials, problem.arguments())(values);
  Mat rows =
      Mat::Zero(static_cast<Eigen::Index>(movable.size()), static_cast<Eigen::Index>(conditions.size()));
  for (std::size_t k = 0; k < entries.size(); ++k) rows(entries[k].column, entries[k].row) = numbers[k];
  std::vector<Expr> result;
  std::vector<Vec> directions;
  for (Eigen::Index i = 0; i < rows.cols(); ++i) {
    Vec left = rows.col(i);
    for (const Vec& d : directions) left -= d.dot(left) * d;
    if (!(left.norm() > 1e-9 * rows.col(i).norm())) continue;
    directions.push_back(left.normalized());
    result.push_back(conditions[i]);
  }
  return result;
}

/// Moves states onto the conditions by the smallest change; false if that does not converge.
static bool repaired(std::vector<double>& values, const std::vector<Expr>& conditions,
                     const std::vector<Expr>& movable, const Problem& problem) {
  dae::Projection stage;
  stage.unknowns = movable;
  stage.residuals = independent(conditions, movable, values, problem);
  stage.jacobian = sparse_jacobian(stage.residuals, movable);
  if (movable.size() < stage.residuals.size()) return false;
  std::vector<double> moved = values;
  try {
    Projector(stage, problem.model().x, problem.arguments()).run(moved, 1);
  } catch (const Failure&) {
    return false;
  }
  values = std::move(moved);
  return true;
}

std::function<void(Point&, const std::vector<int>&)> reinitialiser(const dae::Model& model,
                                                                   const ProblemPtr& problem,
                                                                   const Substitution& inputs) {
  std::vector<Expr> conditions;
  for (const dae::Constraint& c : state_conditions(model)) {
    const Expr e = substitute(dae::resolve(model, c.residual), inputs);
    const std::vector<Expr> inside = leaves({&e, 1});
    const auto foreign = [&](Expr leaf) {
      const auto& z = problem->model().z;
      return std::find(z.begin(), z.end(), leaf) != z.end();
    };
    if (std::none_of(inside.begin(), inside.end(), foreign)) conditions.push_back(e);
  }
  return reinitialiser(conditions, problem);
}

std::function<void(Point&, const std::vector<int>&)> reinitialiser(const std::vector<Expr>& conditions,
                                                                   const ProblemPtr& problem) {
  if (conditions.empty()) return {};
  const auto all = std::make_shared<const Conditions>(conditions, *problem);
  return [problem, all](Point& point, const std::vector<int>& reset) {
    problem->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
    std::vector<double> values = problem->values();
    const std::vector<Expr> broken = all->broken(values);
    if (broken.empty()) return;
    std::vector<Expr> kept;
    for (Expr c : all->list)
      if (std::find(broken.begin(), broken.end(), c) == broken.end()) kept.push_back(c);
    const std::vector<Expr> bound = leaves(kept);
    std::vector<Expr> free, others;
    for (int i = 0; i < problem->n(); ++i) {
      if (std::find(reset.begin(), reset.end(), i) != reset.end()) continue;
      const Expr x = problem->model().x[i];
      others.push_back(x);
      if (std::find(bound.begin(), bound.end(), x) == bound.end()) free.push_back(x);
    }
    if (!(repaired(values, broken, free, *problem) && all->broken(values).empty()) &&
        !repaired(values, all->list, others, *problem))
      throw Failure(text("the values after the reset contradict a constraint of the model, and no change of ",
                         "the other states repairs it; reset more states, or fewer"));
    std::copy_n(values.begin() + 1, point.x.size(), point.x.data());
  };
}

}  // namespace pendula::integrate
