#include "integrate/simulation/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/regimes.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/state_reselection.hpp"

namespace pendula::integrate {

Vec Trajectory::gradient(Expr cost, const std::vector<Expr>& with_respect_to) const {
  if (!start_) throw Error("a solution whose states were switched has no adjoint; integrate another form");
  const Problem& problem = solution_->problem();
  Variational all;  // integrates the form alone
  all.form = problem.model();
  all.n = problem.n();
  all.m = problem.m();
  std::vector<Expr> parameters;
  const auto contains = [](const std::vector<Expr>& list, Expr e) {
    return std::find(list.begin(), list.end(), e) != list.end();
  };
  for (Expr p : with_respect_to) {
    const Expr own = dae::resolve(*model_, p);
    all.with_respect_to.push_back(own);
    if (!contains(all.form.p, own) && !contains(all.form.x, own))
      throw Error(text(to_text(p), " is neither a parameter nor a state of the model"));
    if (contains(all.form.p, own)) parameters.push_back(own);
  }
  const AdjointGradient found = solution_->gradient(resolved(std::span(&cost, 1))[0], parameters);
  std::unordered_map<Expr, double> values;
  for (std::size_t i = 0; i < problem.arguments().size(); ++i) {
    const Expr leaf = problem.arguments()[i];
    if (contains(all.form.p, leaf)) values[leaf] = problem.values()[i];
  }
  values[time_symbol()] = start_->t;
  const Mat S = start_sensitivity(all, *model_, *start_, inputs_, std::move(values));
  Vec result = S.transpose() * found.start;
  for (std::size_t j = 0; j < with_respect_to.size(); ++j) {
    const auto at = std::find(parameters.begin(), parameters.end(), all.with_respect_to[j]);
    if (at != parameters.end()) result[j] += found.parameters[at - parameters.begin()];
  }
  return result;
}

std::vector<Expr> Trajectory::differentiated(std::span<const Expr> expressions, Expr p) const {
  const auto at = std::find(asked_.begin(), asked_.end(), p);
  if (at == asked_.end())
    throw Error(text("the solution has no sensitivities to ", to_text(p),
                     "; integrate with sensitivities = { ", to_text(p), " }"));
  std::vector<Expr> result;
  for (Expr e : resolved(expressions))
    result.push_back(variational_->derivative(e, static_cast<int>(at - asked_.begin())));
  return result;
}

Mat Trajectory::sensitivity(std::span<const Expr> expressions, Expr p) const {
  return solution_->values(differentiated(expressions, p));
}

Vec Trajectory::sensitivity(std::span<const Expr> expressions, Expr p, double t) const {
  return solution_->values(differentiated(expressions, p), t);
}

/// Derivatives that the run does not compute: z′ and x″ from the differentiated equations, ∂F/∂(x′, z) (x″,
/// z′) = -∂F/∂t - ∂F/∂x x′ - ∂F/∂u u′.
static Substitution derivatives_of_unknowns(const dae::FirstOrder& form, const Substitution& inputs) {
  const std::vector<Expr> F = substitute(form.F, inputs);
  std::vector<Expr> unknowns = form.xdot, moving = form.x, speeds = form.xdot;
  unknowns.insert(unknowns.end(), form.z.begin(), form.z.end());
  moving.push_back(time_symbol());
  speeds.push_back(1);
  for (Expr u : form.u) {
    if (inputs.count(u) > 0) continue;
    moving.push_back(u);
    speeds.push_back(derivative_leaf(u));
  }
  VecX right = VecX::Constant(static_cast<Eigen::Index>(F.size()), Expr(0));
  for (const pendula::Entry& e : sparse_jacobian(F, moving)) right[e.row] -= e.value * speeds[e.column];
  const VecX found = linear_solution(sparse_jacobian(F, unknowns), right);
  Substitution result;
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const bool slope = k < form.x.size();
    const Expr leaf = slope ? derivative_leaf(form.x[k], 2) : derivative_leaf(unknowns[k]);
    result[leaf] = found[k];
  }
  return result;
}

std::vector<Expr> Trajectory::resolved(std::span<const Expr> expressions) const {
  std::vector<Expr> result;
  for (Expr e : expressions) result.push_back(substitute(dae::resolve(*model_, e), inputs_));
  const dae::FirstOrder& run = solution_->problem().model();
  const auto known = [&](Expr leaf) {
    const auto in = [&](const std::vector<Expr>& list) {
      return std::find(list.begin(), list.end(), leaf) != list.end();
    };
    return symbol_of(leaf).kind != Kind::variable || symbol_of(leaf).order == 0 || in(run.x) ||
           in(run.xdot) ||
           std::any_of(run.x.begin(), run.x.end(), [&](Expr x) { return derivative_leaf(x) == leaf; });
  };
  const std::vector<Expr> used = leaves(result);
  if (std::all_of(used.begin(), used.end(), known)) return result;
  try {
    return substitute(result, derivatives_of_unknowns(*dae::shared_first_order(model_), inputs_));
  } catch (const Error&) {  // not determined; evaluation reports the missing leaf
    return result;
  }
}

Mat Trajectory::values(std::span<const Expr> expressions) const {
  return solution_->values(resolved(expressions));
}

Vec Trajectory::values(std::span<const Expr> expressions, double t) const {
  return solution_->values(resolved(expressions), t);
}

/// The model's invariants, one chain C, C′, … per equation they came from; else its own constraints.
std::vector<Invariant> Trajectory::invariants() const {
  std::vector<Invariant> result;
  const auto add = [&](const dae::Constraint& c, dae::DriftLaw law) {
    result.push_back({c.label, resolved(std::span(&c.residual, 1)), law, model_->decay});
  };
  for (const dae::Constraint& c : model_->invariants) {
    if (c.derivative != 0) continue;
    add(c, model_->drift);
    if (model_->drift == dae::DriftLaw::none) continue;
    for (int k = 1;; ++k) {
      const auto next =
          std::find_if(model_->invariants.begin(), model_->invariants.end(), [&](const dae::Constraint& d) {
            return d.origin == c.origin && d.row == c.row && d.derivative == k;
          });
      if (next == model_->invariants.end()) break;
      result.back().chain.push_back(resolved(std::span(&next->residual, 1))[0]);
    }
  }
  if (!result.empty()) return result;
  const bool chosen = chooses_states(*model_);  // its equations are those of the model and their derivatives
  const dae::ModelPtr source = chosen ? dae::original(model_) : model_;
  for (const dae::Constraint& c : dae::hidden_constraints_by_offsets(*source, dae::analyse(*source)))
    add(c, dae::DriftLaw::none);
  return result;
}

Drift Trajectory::drift() const {
  Drift result = integrate::drift(*solution_, invariants());
  result.has_regimes = result.rows.empty() && dae::regimes_differ(*model_);
  return result;
}

}  // namespace pendula::integrate
