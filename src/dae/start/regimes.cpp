#include "dae/start/regimes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/regime_jump.hpp"
#include "dae/start/start_system.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t most_candidates = 300;  // each is a start to be solved
constexpr double exact_border = 1e-9;  // relative to the terms of a margin; smaller exact values count as 0
constexpr double close = 1e-7;         // relative to the terms of a condition that counts as satisfied

/// Accuracies to try: exact values, then values accurate to the tolerance of the run that produced them, then
/// to multiples of it, since errors of steps accumulate.
std::vector<Regimes::Accuracy> readings(double rtol) {
  constexpr double coarsest = 0.03;  // of the terms; beyond it signs of margins would say little
  std::vector<Regimes::Accuracy> list{{exact_border, close, true}};
  if (rtol <= 0) return list;
  for (double share : {1.0, 10.0, 100.0})
    if (const double known = share * rtol; known > exact_border && known <= std::max(coarsest, rtol))
      list.push_back({known, std::max(close, 3 * known), false});
  return list;
}

/// Sizes from the values, their largest magnitudes so far, and the units of computed unknowns.
Sizes sizes_at(const ConsistentState& start) {
  Sizes sizes{start.values};
  const auto enlarge = [&](Expr leaf, double size) {
    if (const auto at = sizes.of.find(leaf); at != sizes.of.end())
      at->second = std::max(std::fabs(at->second), size);
  };
  for (const auto& [leaf, size] : start.request.sizes) enlarge(leaf, size);
  for (const auto& [leaf, unit] : start.units) enlarge(leaf, unit);
  double fastest = 0;
  for (Expr x : start.model->states()) {
    const double size = sizes(x), slope = sizes.of.count(derivative_leaf(x)) ? sizes(derivative_leaf(x)) : 0;
    if (size > 0) fastest = std::max(fastest, slope / size);
  }
  if (fastest > 0) sizes.rate = fastest;
  return sizes;
}

/// The sign of an expression shortly after the start, extrapolated along the slopes. For expressions whose
/// slope differs before and after the start, like that of √(sin² t) at t = 0.
int sign_ahead(Expr e, const ConsistentState& start, const Sizes& sizes, double border) {
  constexpr double share = 1e-6;        // of the time scale of the states
  constexpr double three_digits = 1e3;  // of the step at a large t
  PointValues ahead = start.values;
  const double dt = share * (sizes.rate > 0 ? 1 / sizes.rate : 1.0);
  for (Expr leaf : leaves({&e, 1})) {
    if (leaf == time_symbol()) {
      ahead[leaf] += std::max(dt, three_digits * rounding_of_sums * std::fabs(ahead[leaf]));
      continue;
    }
    const auto slope = start.values.find(derivative_leaf(leaf));
    if (symbol_of(leaf).kind == Kind::variable && slope != start.values.end())
      ahead[leaf] += dt * slope->second;
  }
  const double there = value_at(e, ahead);
  Sizes moved = sizes;
  for (const auto& [leaf, value] : ahead) moved.of[leaf] = std::max(std::fabs(value), sizes(leaf));
  const double size = size_of(e, ahead, moved);
  return std::fabs(there) > border * size ? (there > 0 ? 1 : -1) : 0;
}

/// The sign (-1, 0, 1) of the impulse through a margin.
int impulse_through(Expr margin, const ConsistentState& start, const Jump& jump, double border) {
  double impulse = 0, noise = 0;
  for (const auto& [leaf, size] : jump.impulses) {
    const double slope = value_at(partial(margin, leaf), start.values);
    impulse += slope * size;
    noise += std::fabs(slope) * jump.sizes.at(leaf);
  }
  return std::fabs(impulse) > border * noise ? (impulse > 0 ? 1 : -1) : 0;
}

/// The size of the terms with derivatives that the start does not contain and that are computed
/// from the equations.
double size_of_derived(Expr e, const ConsistentState& start) {
  double sum = 0;
  for (Expr leaf : leaves({&e, 1}))
    if (!start.values.count(leaf) && symbol_of(leaf).kind == Kind::variable)
      sum += std::fabs(value_at(partial(e, leaf), start.values) * start(leaf));
  return std::isfinite(sum) ? sum : 0;
}

/// The sign (-1, 0, 1) of a margin just after the start, including impulses.
int sign_behind(Expr margin, const ConsistentState& start, const Jump& jump, double border) {
  constexpr int highest = 4;  // derivative
  if (const int sign = impulse_through(margin, start, jump, border); sign != 0) return sign;
  const Sizes sizes = sizes_at(start);
  Expr e = margin;
  for (int order = 0; order <= highest; ++order) {
    double here = 0, size = 0;
    try {
      here = start(e);
      size = size_of(e, start.values, sizes);
    } catch (const UserFacing&) {  // an undetermined derivative, or a size that contains one
      if (here == 0)
        return std::isnan(value_at(e, start.values)) ? sign_ahead(margin, start, sizes, border) : 0;
    }
    if (std::fabs(here) > border * std::max(size, size_of_derived(e, start))) return here > 0 ? 1 : -1;
    if (margin.op() == Op::ifelse) return 1;
    e = total_derivative(e);
  }
  return 0;
}

/// Is e zero relative to its terms? False for undetermined derivatives.
bool is_zero(Expr e, const ConsistentState& start, const Sizes& sizes, double border) {
  try {
    return std::fabs(start(e)) <= border * size_of(e, start.values, sizes);
  } catch (const UserFacing&) {
    return false;
  }
}

std::string answer(const Model& m) {
  const Analysis a = analyse(m);
  return a.regular ? text(a.index, " ", a.dof) : "singular";
}

/// Time, parameters and inputs.
std::unordered_map<Expr, double> conditions_of(const Model& model, const StartRequest& request) {
  std::unordered_map<Expr, double> values{{time_symbol(), request.t}};
  const auto add = [&](const ParameterValues& list) {
    for (const auto& [p, value] : list) values[p] = pendula::evaluate({&value, 1}, {})[0];
  };
  for (Expr p : model.parameters)
    if (symbol_of(p).value) values[p] = pendula::evaluate({&*symbol_of(p).value, 1}, {})[0];
  add(model.values);
  add(request.parameters);
  for (const auto& [u, e] : request.inputs)
    for (Expr p : leaves({&e, 1}))
      if (symbol_of(p).kind == Kind::parameter && symbol_of(p).value)
        values.try_emplace(p, pendula::evaluate({&*symbol_of(p).value, 1}, {})[0]);
  const std::unordered_map<Expr, double> known = values;
  for (const auto& [u, e] : request.inputs) values[u] = pendula::evaluate({&e, 1}, known)[0];
  return values;
}

/// A consistent state; fixed values that contradict the constraints by rounding are moved onto them.
ConsistentStatePtr consistent(const ModelPtr& model, StartRequest request) {
  try {
    return init(model, request);
  } catch (const UserFacing&) {
    request.nearest = true;
    return init(model, request);
  }
}

void raise(LeafValues& sizes, Expr leaf, double least) {
  const auto at =
      std::find_if(sizes.begin(), sizes.end(), [&](const auto& known) { return known.first == leaf; });
  if (at == sizes.end())
    sizes.emplace_back(leaf, least);
  else
    at->second = std::max(at->second, least);
}

}  // namespace

std::unordered_map<Expr, double> values_before(const Model& model, const StartRequest& request) {
  std::unordered_map<Expr, double> values = conditions_of(model, request);
  for (const auto* list : {&request.guess, &request.fix})
    for (const auto& [leaf, value] : *list) values[leaf] = value;
  return values;
}

ModelPtr region_model(const ModelPtr& model, const Region& region) {
  ModelOptions options = child_of(model);
  options.trace.push_back("in the region " + region.where);
  declare_unknowns(options, *model);
  std::vector<Block> blocks;
  std::size_t next = 0;
  for (const Block& b : model->blocks) {
    Block own{VecX::Zero(b.lhs.size()), VecX::Zero(b.lhs.size()), b.note, b.rewritten};
    for (Eigen::Index row = 0; row < b.lhs.size(); ++row) own.rhs[row] = region.model.residuals[next++];
    blocks.push_back(std::move(own));
  }
  return make_model(std::move(blocks), std::move(options));
}

static std::vector<int> signs_after(const Region& region, const ConsistentState& start, const Jump& jump,
                                    double border) {
  std::vector<int> signs;
  for (Expr margin : region.margins) signs.push_back(sign_behind(margin, start, jump, border));
  return signs;
}

int sign_after(Expr margin, const ConsistentState& start) {
  return sign_behind(margin, start, {}, exact_border);
}

bool stays_in(const Region& region, const ConsistentState& start) {
  return std::none_of(region.margins.begin(), region.margins.end(),
                      [&](Expr margin) { return sign_after(margin, start) < 0; });
}

Regimes::Regimes(ModelPtr model) : model_(std::move(model)), choices_(*model_) {}

Choices::Decided Regimes::decided(const StartRequest& request) const {
  return choices_.decided(conditions_of(*model_, request));
}

static bool find_difference(const Model& m) {
  constexpr std::size_t few = 3, most = 20;  // choices: all 2^few regions are compared; above most none
  const Choices choices(m);
  if (choices.size() == 0 || choices.size() > most) return false;
  if (std::any_of(m.residuals.begin(), m.residuals.end(), is_complementarity)) return true;
  if (choices.size() > few) return false;
  const std::string whole = answer(m);
  for (std::uint64_t choice = 0; choice < std::uint64_t{1} << choices.size(); ++choice)
    if (answer(choices.region(choice).model) != whole) return true;
  return false;
}

bool regimes_differ(const Model& m) {
  constexpr std::size_t affordable = 100;  // unknowns: an index analysis per region
  if (m.variables.size() > affordable || m.residuals.size() != m.variables.size()) return false;
  static ModelCache<bool> known(cached_models);
  const ModelKey key = key_of(m);
  if (const bool* differ = known.find(key)) return *differ;
  return known.insert(key, find_difference(m));
}

/// The conditions on the states of a model.
static std::vector<Expr> conditions_on_states(const Model& model) {
  const std::vector<Expr> states = model.states();
  std::vector<Expr> conditions;
  for (const Constraint& c : hidden_constraints(model).constraints) {
    const std::vector<Expr> inside = leaves({&c.residual, 1});
    if (std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
          return symbol_of(leaf).kind != Kind::variable ||
                 std::find(states.begin(), states.end(), leaf) != states.end();
        }))
      conditions.push_back(c.residual);
  }
  return conditions;
}

const Regime& Regimes::regime(std::uint64_t choice) {
  const auto known = known_.find(choice);
  if (known != known_.end()) return known->second;
  Regime regime{choice, choices_.region(choice), nullptr, nullptr, 0, {}};
  try {
    ModelPtr model = region_model(model_, regime.region);
    regime.conditions = conditions_on_states(*model);
    if (const Substitution resting = resting_signs(model->residuals, regime.conditions); !resting.empty()) {
      regime.region.model.residuals = substitute(regime.region.model.residuals, resting);
      model = region_model(model_, regime.region);
    }
    const Analysis analysis = analyse(*model);
    regime.index = differentiation_index(*model, analysis).index;
    regime.form = regime.index <= 1 && analysis.regular && analysis.index <= 1 ? model : reduce(model, "");
    regime.model = model;
  } catch (const UserFacing&) {
    regime.form = nullptr;  // singular
  }
  return known_.emplace(choice, std::move(regime)).first->second;
}

std::vector<Expr> Regimes::lasting_conditions(const Regime& regime) {
  std::vector<Expr> lasting = regime.conditions;
  for (std::size_t k = 0; k < choices_.size() && !lasting.empty(); ++k) {
    const Regime& other = this->regime(regime.choice ^ (std::uint64_t{1} << k));
    if (!other.model) continue;
    std::erase_if(lasting, [&](Expr c) {
      return std::none_of(other.conditions.begin(), other.conditions.end(), [&](Expr d) {
        return c == d || simplify(c - d).is_zero() || simplify(c + d).is_zero();
      });
    });
  }
  return lasting;
}

/// For each margin, the negative value that errors can cause within the region.
static std::vector<double> slack_of(const Region& region, const ConsistentState& start,
                                    const std::vector<int>& signs, const Regimes::Accuracy& accuracy) {
  std::vector<double> slack;
  const Sizes sizes = sizes_at(start);
  const auto is_zero_here = [&](Expr e) { return is_zero(e, start, sizes, accuracy.border); };
  for (std::size_t k = 0; k < signs.size(); ++k) {
    const Expr margin = region.margins[k];
    const double here = std::fabs(value_at(margin, start.values));
    const double size = size_of(margin, start.values, sizes);
    if (signs[k] <= 0)
      slack.push_back(2 * here + accuracy.border * size);
    else if (is_zero_here(margin) && is_zero_here(total_derivative(margin)))
      // a margin that is 0 and grows like t² consists of errors at first
      slack.push_back(2 * here + (accuracy.exact ? rounding_of_sums : accuracy.border) * size);
    else
      slack.push_back(0);
  }
  return slack;
}

std::optional<RegimeStart> Regimes::enter_one(const StartRequest& before, std::uint64_t choice,
                                              const Accuracy& accuracy, std::string& why) {
  const Regime& regime = this->regime(choice);
  const auto refused = [&](const std::string& reason) {
    why += "\n  where " + regime.region.where + ": " + reason;
    return std::nullopt;
  };
  if (!regime.model) return refused("the equations are singular");
  const FirstOrder form = first_order(*regime.model);
  std::string unknown;
  const auto jump = jump_onto(regime.conditions, form, values_before(*regime.model, before), before.sizes,
                              accuracy.close, unknown);
  if (!jump)
    return refused(unknown.empty() ? "no impulse that the equations allow leads onto the constraints"
                                   : unknown);
  StartRequest request = before;
  for (auto& [leaf, value] : request.fix)
    if (const auto at = std::find(form.x.begin(), form.x.end(), leaf); at != form.x.end())
      value += jump->change[at - form.x.begin()];
  try {
    auto at = std::make_shared<ConsistentState>(*consistent(regime.model, request));
    std::vector<int> signs = signs_after(regime.region, *at, jump->jumps ? *jump : Jump{}, accuracy.border);
    const auto leaves = [&] { return std::find(signs.begin(), signs.end(), -1) != signs.end(); };
    if (leaves()) return refused("its solution from these values moves outside this region");
    std::vector<Expr> impulse_margins;
    if (jump->jumps) {
      for (std::size_t k = 0; k < regime.region.margins.size(); ++k)
        if (impulse_through(regime.region.margins[k], *at, *jump, accuracy.border) > 0)
          impulse_margins.push_back(choices_.region(choice ^ (std::uint64_t{1} << k)).margins[k]);
      signs = signs_after(regime.region, *at, {}, accuracy.border);
      if (leaves()) {  // an impact that leaves the region at once
        auto next = enter_within(request, choice, choice, accuracy, why);
        if (next) next->jumps = true;
        if (next)
          next->impulse_margins.insert(next->impulse_margins.end(), impulse_margins.begin(),
                                       impulse_margins.end());
        return next;
      }
    }
    std::vector<Expr> undecided;
    for (std::size_t k = 0; k < signs.size(); ++k)
      if (signs[k] == 0 && !regime.region.margins[k].is_constant())
        undecided.push_back(regime.region.margins[k]);
    std::vector<double> slack = slack_of(regime.region, *at, signs, accuracy);
    return RegimeStart{&regime, at, jump->jumps, std::move(slack), undecided, impulse_margins};
  } catch (const UserFacing& e) {
    return refused(e.what());
  }
}

std::optional<RegimeStart> Regimes::enter_within(const StartRequest& request, std::uint64_t near,
                                                 std::optional<std::uint64_t> without,
                                                 const Accuracy& accuracy, std::string& why) {
  const std::uint64_t all = std::uint64_t{1} << choices_.size();
  const Choices::Decided known = decided(request);
  const int most = static_cast<int>(choices_.size());
  std::size_t tried = 0;
  for (int k = 0; k <= most; ++k) {
    // with inexact values the present choice, known to end here, is tried last
    const int flips = accuracy.exact ? k : (k + 1) % (most + 1);
    for (std::uint64_t mask = 0; mask < all; ++mask) {
      if (std::popcount(mask) != flips || !known.allow(near ^ mask) || (without && (near ^ mask) == *without))
        continue;
      if (++tried > most_candidates) return {};
      if (auto found = enter_one(request, near ^ mask, accuracy, why)) return found;
    }
  }
  return {};
}

std::optional<RegimeStart> Regimes::enter(const StartRequest& request, std::uint64_t near,
                                          std::optional<std::uint64_t> without, std::string& why,
                                          const Tolerance& tolerance) {
  StartRequest measured = request;
  for (const Accuracy& accuracy : readings(tolerance.rtol)) {
    if (accuracy.exact) {
      if (auto found = enter_within(request, near, without, accuracy, why)) return found;
      for (const auto& [leaf, least] : tolerance.least) raise(measured.sizes, leaf, least);
      continue;
    }
    std::string unused;
    if (auto found = enter_within(measured, near, without, accuracy, unused)) return found;
  }
  return {};
}

}  // namespace pendula::dae
