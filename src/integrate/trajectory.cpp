#include "integrate/trajectory.hpp"

#include <algorithm>

#include "base/text.hpp"
#include "dae/reduce.hpp"
#include "expr/print.hpp"

namespace pendula::integrate {
namespace {

void require_low_index(const dae::Model& model, bool direct) {
  const dae::Analysis analysis = dae::analyse(model);
  if (direct || !analysis.regular || analysis.index <= 1)
    return;  // not regular: the engine looks at the numbers
  throw Error(text("the model has index ", analysis.index,
                   "; fixed-step integration needs index 0 or 1. Integrate a reduced ",
                   "form: sys:reduce():integrate{…}, or sys:reduce \"acc\" to see the drift, or study the ",
                   "model as it stands with direct = true"));
}

double parameter_value(Expr p, const dae::Model& model, const Simulation& simulation) {
  const std::string name = to_text(p);
  std::optional<Expr> value = symbol_of(p).value;
  if (const auto it = model.values.find(p); it != model.values.end()) value = it->second;
  if (const auto it = simulation.parameters.find(p); it != simulation.parameters.end()) value = it->second;
  if (!value) {
    throw Error(text("the parameter '", name, "' has no value; give params = { ", name,
                     " = … } or use sys:with{ ", name, " = … }"));
  }
  return evaluate(std::span(&*value, 1), {})[0];
}

/// Writes known inputs into the equations: their leaves are gone, parameters in their expressions are new.
void insert_inputs(dae::FirstOrder& form, const Substitution& inputs) {
  std::erase_if(form.u, [&](Expr u) { return inputs.count(u) > 0; });
  if (inputs.empty()) return;
  for (auto* equations : {&form.F, &form.f, &form.g}) *equations = substitute(*equations, inputs);
  for (Expr leaf : leaves(form.F)) {
    const bool parameter = symbol_of(leaf).kind == Kind::parameter;
    if (parameter && std::find(form.p.begin(), form.p.end(), leaf) == form.p.end()) form.p.push_back(leaf);
  }
}

Problem::Input input_of(Expr leaf, const Simulation& simulation) {
  for (const auto& [known, function] : simulation.numeric_inputs)
    if (known == leaf) return function;
  const std::string name = to_text(symbol_of(leaf).base);
  for (const auto& [known, function] : simulation.numeric_inputs)
    if (known == symbol_of(leaf).base) {
      throw Error(text("the equations contain ", to_text(leaf), ", but the function given for the input '",
                       name, "' could not be followed symbolically; give an expression in t instead"));
    }
  throw Error(text("the input '", name, "' has no values; give inputs = { ", name, " = function(t) … end }"));
}

Point starting_point(const dae::Start& start, const dae::FirstOrder& form) {
  const auto value = [&](Expr leaf) {
    const auto it = start.values.find(leaf);
    return it == start.values.end() ? 0.0 : it->second;
  };
  Point point;
  point.x.resize(static_cast<Eigen::Index>(form.x.size()));
  point.xdot.resize(point.x.size());
  point.z.resize(static_cast<Eigen::Index>(form.z.size()));
  for (std::size_t i = 0; i < form.x.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    PENDULA_ASSERT(start.values.count(form.x[i]), "a start without a value for a state");
    point.x[k] = value(form.x[i]);
    point.xdot[k] = value(derivative_leaf(form.x[i]));  // also where a slot stands for it
  }
  for (std::size_t i = 0; i < form.z.size(); ++i) point.z[static_cast<Eigen::Index>(i)] = value(form.z[i]);
  return point;
}

/// The model's projections with known inputs written into them.
std::vector<dae::Projection> projections(const dae::Model& model, const Substitution& inputs) {
  std::vector<dae::Projection> stages = model.projections;
  for (dae::Projection& stage : stages) {
    stage.residuals = substitute(stage.residuals, inputs);
    for (Entry& e : stage.jacobian) e.value = substitute(e.value, inputs);
    for (Expr& e : stage.weight.reshaped()) e = substitute(e, inputs);
  }
  return stages;
}

}  // namespace

TrajectoryPtr simulate(const dae::ModelPtr& model, const Simulation& simulation) {
  require_low_index(*model, simulation.plan.direct);
  dae::FirstOrder form = dae::first_order(*model);
  insert_inputs(form, simulation.inputs);
  Vec parameters(static_cast<Eigen::Index>(form.p.size()));
  for (std::size_t i = 0; i < form.p.size(); ++i)
    parameters[static_cast<Eigen::Index>(i)] = parameter_value(form.p[i], *model, simulation);
  std::vector<Problem::Input> inputs;
  for (Expr u : form.u) inputs.push_back(input_of(u, simulation));
  const Point start = starting_point(*simulation.start, form);
  const auto problem = std::make_shared<Problem>(std::move(form), std::move(parameters), std::move(inputs));
  problem->set_projections(projections(*model, simulation.inputs));
  return std::make_shared<const Trajectory>(model, simulation.inputs,
                                            integrate(problem, simulation.method, start, simulation.plan));
}

std::vector<Expr> Trajectory::resolved(std::span<const Expr> expressions) const {
  std::vector<Expr> result;
  for (Expr e : expressions) result.push_back(substitute(dae::resolve(*model_, e), inputs_));
  return result;
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
  const auto add = [&](const dae::Constraint& c, bool polynomial) {
    result.push_back({c.label, resolved(std::span(&c.residual, 1)), polynomial});
  };
  for (const dae::Constraint& c : model_->invariants) {
    if (c.derivative != 0) continue;
    add(c, model_->drift == dae::DriftLaw::polynomial);
    if (model_->drift != dae::DriftLaw::polynomial) continue;
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
  const dae::Analysis analysis = dae::analyse(*model_);
  if (analysis.regular)
    for (const dae::Constraint& c : analysis.constraints) add(c, false);
  return result;
}

Drift Trajectory::drift() const { return integrate::drift(*solution_, invariants()); }

}  // namespace pendula::integrate
