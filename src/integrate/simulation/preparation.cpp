#include "integrate/simulation/preparation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "base/lru_cache.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"

namespace pendula::integrate {

/// Substitutes known inputs: their leaves disappear, and the parameters of their expressions are added.
static void insert_inputs(dae::FirstOrder& form, const Substitution& inputs) {
  std::erase_if(form.u, [&](Expr u) { return inputs.count(u) > 0; });
  if (inputs.empty()) return;
  for (auto* equations : {&form.F, &form.f, &form.g}) *equations = substitute(*equations, inputs);
  for (Expr leaf : leaves(form.F)) {
    const bool parameter = symbol_of(leaf).kind == Kind::parameter;
    if (parameter && std::find(form.p.begin(), form.p.end(), leaf) == form.p.end()) form.p.push_back(leaf);
  }
}

/// Adds inputs that occur only in conditions, events or expressions evaluated on the solution.
static void add_inputs(dae::FirstOrder& form, const dae::Model& model, const Simulation& simulation) {
  std::vector<Expr> conditions;
  for (const dae::Projection& stage : model.projections)
    conditions.insert(conditions.end(), stage.residuals.begin(), stage.residuals.end());
  for (const dae::Constraint& c : model.invariants) conditions.push_back(c.residual);
  const std::vector<Expr> used = leaves(conditions);
  for (const auto& [leaf, function] : simulation.numeric_inputs) {
    const bool wanted = symbol_of(leaf).order == 0 || std::find(used.begin(), used.end(), leaf) != used.end();
    if (wanted && std::find(form.u.begin(), form.u.end(), leaf) == form.u.end()) form.u.push_back(leaf);
  }
}

/// Parameters that occur in events alone are parameters of the problem as well.
static void add_event_parameters(dae::FirstOrder& form, const std::vector<ModelEvent>& events) {
  std::vector<Expr> all;
  for (const ModelEvent& event : events) {
    all.push_back(event.when);
    for (const auto& [state, value] : event.reset) all.push_back(value);
  }
  for (Expr leaf : leaves(all))
    if (symbol_of(leaf).kind == Kind::parameter &&
        std::find(form.p.begin(), form.p.end(), leaf) == form.p.end())
      form.p.push_back(leaf);
}

/// The projections of the model, with known inputs substituted.
static std::vector<dae::Projection> projections(const dae::Model& model, const Substitution& inputs) {
  std::vector<dae::Projection> stages = model.projections;
  if (inputs.empty()) return stages;
  for (dae::Projection& stage : stages) {
    stage.residuals = substitute(stage.residuals, inputs);
    for (Entry& e : stage.jacobian) e.value = substitute(e.value, inputs);
    for (Entry& e : stage.weight) e.value = substitute(e.value, inputs);
  }
  return stages;
}

namespace {

/// The key of the cache: everything that a Preparation depends on.
std::vector<std::uint32_t> preparation_key(const dae::ModelPtr& model, const Simulation& simulation) {
  const auto address = reinterpret_cast<std::uintptr_t>(model.get());
  std::vector<std::uint32_t> key{static_cast<std::uint32_t>(address),
                                 static_cast<std::uint32_t>(static_cast<std::uint64_t>(address) >> 32),
                                 simulation.plan.dt.has_value(), simulation.many_parameters};
  const auto begin_list = [&key](std::size_t size) { key.push_back(static_cast<std::uint32_t>(size)); };
  const std::map<std::uint32_t, std::uint32_t> inputs = [&] {
    std::map<std::uint32_t, std::uint32_t> sorted;
    for (const auto& [leaf, e] : simulation.inputs) sorted[leaf.id()] = e.id();
    return sorted;
  }();
  begin_list(inputs.size());
  for (const auto& [leaf, e] : inputs) key.insert(key.end(), {leaf, e});
  begin_list(simulation.numeric_inputs.size());
  for (const auto& [leaf, function] : simulation.numeric_inputs) key.push_back(leaf.id());
  begin_list(simulation.sensitivities.size());
  for (Expr p : simulation.sensitivities) key.push_back(p.id());
  for (const ModelEvent& event : simulation.events) {
    begin_list(event.reset.size());
    key.push_back(event.when.id());
    for (const auto& [state, value] : event.reset) key.insert(key.end(), {state.id(), value.id()});
  }
  return key;
}

}  // namespace

PreparationPtr prepared(const dae::ModelPtr& model, const Simulation& simulation) {
  constexpr std::size_t equations = 200'000;  // capacity; an entry counts as 1000 more
  static LruCache<std::vector<std::uint32_t>, PreparationPtr, WordsHash> known(equations);
  const auto key = preparation_key(model, simulation);
  if (const PreparationPtr* found = known.find(key)) {
    Origins::add((*found)->origins);
    return *found;
  }
  auto made = std::make_shared<Preparation>();
  made->model = model;
  made->form = *dae::shared_first_order(model);
  insert_inputs(made->form, simulation.inputs);
  add_event_parameters(made->form, simulation.events);
  made->stages = projections(*model, simulation.inputs);
  add_inputs(made->form, *model, simulation);
  return known.insert(key, made, 1000 + made->form.F.size());
}

void watch_singularities(Plan& plan, const dae::ModelPtr& model, const Simulation& simulation,
                         const Problem& problem) {
  const PreparationPtr kept = prepared(model, simulation);
  if (!kept->guards) {
    // All guards are needed: no consistent point of w y = 1 has y = 0, and yet y can cross 0 where w
    // has a pole.
    kept->guards = guards_of(model, simulation.inputs, problem, true);
    kept->choices = choices_of(model, simulation.inputs, problem);
    kept->blocks = blocks_of(model, simulation.inputs, problem);
    kept->origins = Origins::so_far();
  }
  plan.guards = *kept->guards;
  plan.choices = kept->choices;
  plan.blocks = kept->blocks;
}

/// Replaces parameters with values 0 or ±1 by numbers, which saves products, as with a zero dy of a rod. A
/// parameter that has a different value in a later run remains a symbol from then on.
static void fold_parameters(Preparation& all, const Vec& parameters, dae::FirstOrder& form) {
  constexpr std::size_t largest = 200;  // equations; loop detection needs many equal parts to stay equal
  const std::size_t count = all.form.p.size();
  all.varies.resize(count, 0);
  all.folded.clear();
  if (form.F.size() > largest) return;
  Substitution numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (all.parameters.size() == parameters.size() && all.parameters[k] != parameters[k]) all.varies[i] = 1;
    if (all.varies[i] || (parameters[k] != 0 && std::abs(parameters[k]) != 1)) continue;
    numbers[form.p[i]] = Expr(parameters[k]);
    all.folded.push_back(i);
  }
  if (numbers.empty()) return;
  try {
    dae::FirstOrder folded = form;
    for (auto* equations : {&folded.F, &folded.f, &folded.g}) *equations = substitute(*equations, numbers);
    form = std::move(folded);
  } catch (const Error&) {  // a division by such a 0, which the run reports itself
    all.folded.clear();
  }
}

void complete(Preparation& all, const Vec& parameters, const Simulation& simulation) {
  dae::FirstOrder form = all.form;
  Vec values = parameters;
  all.problem.reset();
  if (!simulation.plan.dt) {
    all.piecewise = std::make_shared<const PiecewiseForm>(
        form, std::span<const double>(parameters.data(), form.p.size()));
    const std::vector<Treatment> frozen(all.piecewise->surfaces().size(), Treatment::frozen);
    form = all.piecewise->form(frozen).form;
    values.conservativeResize(static_cast<Eigen::Index>(form.p.size()));
    values.tail(all.piecewise->modes()).setOnes();
  }
  const int n = static_cast<int>(form.x.size()), m = static_cast<int>(form.z.size());
  std::vector<Expr> residuals = form.F;
  if (simulation.sensitivities.empty() && !simulation.many_parameters) fold_parameters(all, parameters, form);
  if (!simulation.sensitivities.empty()) {
    std::vector<Expr> own;
    for (Expr p : simulation.sensitivities) own.push_back(dae::resolve(*all.model, p));
    all.variational = std::make_shared<const Variational>(variational(form, own));
    form = all.variational->form;
  }
  // placeholders: the inputs of a run must not outlive it
  const std::vector<Problem::Input> no_inputs(form.u.size(), [](double) { return 0.0; });
  auto problem = std::make_shared<Problem>(std::move(form), values, no_inputs);
  if (!all.folded.empty()) problem->keep_symbolic(std::move(residuals));
  problem->set_visible_size(n, m, all.variational ? all.variational->with_respect_to : std::vector<Expr>());
  problem->set_projections(all.stages);
  all.parameters = parameters;
  all.problem = std::move(problem);
  all.origins = Origins::so_far();
}

}  // namespace pendula::integrate
