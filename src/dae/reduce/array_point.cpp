#include "dae/reduce/array_point.hpp"

#include <algorithm>

#include "dae/index/differentiation_index.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/rank/rank_with_gap.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// Values of the other leaves: those given by the caller, else the parameter values, else random.
std::unordered_map<Expr, double> known_values(const NumericArray& numeric, const Model& m, int seed,
                                              const std::unordered_map<Expr, double>& near) {
  auto known = numeric.known(seed);
  for (auto& [leaf, value] : known) {
    if (const auto own = m.values.find(leaf); own != m.values.end())
      value = pendula::evaluate({&own->second, 1}, {})[0];
    if (const auto given = near.find(leaf); given != near.end()) value = given->second;
  }
  return known;
}

/// Solves F_0 = 0, then F_1 = 0 … up to F_k = 0, each from the previous point, for cases where Newton's
/// method finds no point of F_k = 0 directly.
class StagedPoints {
 public:
  StagedPoints(const Model& m, int order, const std::unordered_map<Expr, double>& near) : model_(m) {
    DerivativeArray array(m.residuals, m.variables);
    for (int k = 0; k <= order; ++k) {
      stages_.emplace_back(array);
      if (!m.values.empty()) stages_.back().measure_time(residuals_at_values(m));
      if (!stages_.back().suits(near)) stages_.back().measure_near(near);
      if (k < order) array.extend();
    }
  }

  /// held: number of leading unknowns that keep their values.
  std::optional<NumericArray::Solution> point(int seed, std::unordered_map<Expr, double> values,
                                              Index held = 0) const {
    std::optional<NumericArray::Solution> at;
    for (const NumericArray& stage : stages_) {
      at = stage.project(stage.start(seed, values), known_values(stage, model_, seed, values), held);
      if (!at) return {};
      for (std::size_t j = 0; j < stage.columns().size(); ++j) values[stage.columns()[j]] = at->w[j];
    }
    return at;
  }

  /// The unknowns of the last stage.
  const std::vector<Expr>& columns() const { return stages_.back().columns(); }

 private:
  const Model& model_;
  std::vector<NumericArray> stages_;
};

}  // namespace

ArrayEquations::ArrayEquations(const Model& m, int order) : array(m.residuals, m.variables) {
  for (int k = 0; k < order; ++k) array.extend();
  columns = array.columns();
  if (columns.size() > most_columns) return;
  numeric.emplace(array);
  if (!m.values.empty()) numeric->measure_time(residuals_at_values(m));
}

std::optional<ArrayPoint> regular_point(const Model& m, const ArrayEquationsPtr& equations,
                                        const std::unordered_map<Expr, double>& near) {
  constexpr int seeds = 16;  // starting values tried
  if (!equations->numeric) return {};
  std::optional<NumericArray> measured;
  if (!equations->numeric->suits(near)) {
    measured = equations->numeric;
    measured->measure_near(near);
  }
  const NumericArray& numeric = measured ? *measured : *equations->numeric;
  ArrayPoint best{equations, {}, {}, {}};
  int most = -1;
  std::optional<StagedPoints> staged;
  const auto point = [&](int seed, const std::unordered_map<Expr, double>& known) {
    if (staged) return staged->point(seed, near);
    const auto& x = best.array().states();
    const bool given = std::all_of(x.begin(), x.end(), [&](Expr leaf) { return near.count(leaf) > 0; });
    const Vec from = numeric.start(seed, near);
    // at a consistent start itself: near a start at rest, rows may be regular that are singular at rest
    const auto there = given ? numeric.project(from, known, best.states()) : std::nullopt;
    return there && !there->slow ? there : numeric.project(from, known, 0);
  };
  for (int attempt = 0; attempt < 2 * seeds && !(attempt >= seeds && most >= 0); ++attempt) {
    const int seed = attempt % seeds;
    if (attempt == seeds) staged.emplace(m, best.array().order(), near);
    const auto known = known_values(numeric, m, seed, near);
    const auto at = point(seed, known);
    if (!at || at->slow) continue;
    const ArrayRanks ranks = numeric.ranks(*at, known);
    if (ranks.y != best.first() + ranks.higher || ranks.y < best.first() || ranks.all <= most) continue;
    most = ranks.all;
    best.w = at->w;
    best.known = known;
    best.J = equilibrated(numeric.jacobian(at->w, known));
    if (ranks.balanced) best.J = balance(best.J)(best.J);
    if (most == static_cast<int>(best.array().rows().size()) || !near.empty()) break;
  }
  if (most < 0) return {};
  return best;
}

std::unordered_map<Expr, double> values_at_regular_point(const Model& m, int order) {
  const auto at = regular_point(m, std::make_shared<const ArrayEquations>(m, order), {});
  if (!at) return {};
  auto values = at->known;
  const std::vector<Expr>& columns = at->equations->columns;
  for (std::size_t j = 0; j < columns.size(); ++j) values[columns[j]] = at->w[j];
  return values;
}

std::unordered_map<Expr, double> derivatives_near(const ModelPtr& array,
                                                  const std::unordered_map<Expr, double>& point) {
  const ModelPtr source = to_first_order(original(array));
  constexpr int trials = 4;  // starting values of every stage
  const StagedPoints stages(*source, differentiation_index(*source).index, point);
  std::unordered_map<Expr, double> found;
  const auto states = static_cast<Index>(source->variables.size());
  for (int seed = 0; seed < trials && found.empty(); ++seed)
    if (const auto at = stages.point(seed, point, states))
      for (std::size_t j = 0; j < stages.columns().size(); ++j)
        found[resolve(*array, stages.columns()[j])] = at->w[j];
  return found;
}

}  // namespace pendula::dae
