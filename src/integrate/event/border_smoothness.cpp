#include "integrate/event/border_smoothness.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrate/event/border_difference.hpp"

namespace pendula::integrate {
namespace {

constexpr int points = 4;      // on the border; an accidental zero at all of them has probability 0
constexpr int attempts = 24;   // to find them; some lie outside the domain of a root
constexpr double aside = 0.1;  // distance of comparison points from the border; leaves are of size 1
/// Threshold for a difference on the border relative to its value at distance `aside`. On a border located to
/// 10⁻¹⁶ the ratio is 10⁻¹⁵ for a difference linear in the distance, 10⁻⁸ for a root and 1 for a jump.
/// Rounding of large terms can make a smooth difference look like a jump, never the reverse.
constexpr double zero = 1e-6;
constexpr std::size_t most_leaves = 400;  // of one border; larger ones are judged where they are crossed

/// The largest |value| of a range; NaN counts as infinite.
double largest(const std::vector<double>& values, std::size_t first, std::size_t last) {
  double size = 0;
  for (std::size_t k = first; k < last; ++k)
    size = std::isnan(values[k]) ? INFINITY : std::max(size, std::fabs(values[k]));
  return size;
}

}  // namespace

/// The difference of the residuals between the two sides of a border.
struct BorderSmoothness::Difference {
  std::vector<Expr> outputs;        ///< D in parts, then ∂D/∂y of each part for its leaves
  std::vector<std::size_t> starts;  ///< of the slopes of each part, and the end
  std::size_t parts = 0;
};

BorderSmoothness::BorderSmoothness(std::vector<Expr> equations, const std::vector<Expr>& modes,
                                   const std::vector<Surface>& surfaces, std::vector<Expr> whens,
                                   const std::vector<Expr>& parameters, std::span<const double> values)
    : equations_(std::move(equations)), modes_(modes), surfaces_(surfaces), whens_(std::move(whens)) {
  for (const Surface& surface : surfaces)
    for (const Mode& mode : surface.modes) kind_[modes[mode.number]] = mode.kind;
  for (std::size_t i = 0; i < equations_.size(); ++i)
    for (Expr leaf : leaves({&equations_[i], 1}))
      if (kind_.count(leaf)) rows_of_[leaf].push_back(i);
  for (std::size_t j = 0; j < parameters.size() && j < values.size(); ++j) known_[parameters[j]] = values[j];
  for (Expr when : whens_) {
    std::vector<Expr> inside = open_leaves(when);
    std::sort(inside.begin(), inside.end(), [](Expr a, Expr b) { return a.id() < b.id(); });
    leaves_of_.push_back(std::move(inside));
  }
}

/// Leaves without a known value: unknowns, t, inputs and modes.
std::vector<Expr> BorderSmoothness::open_leaves(Expr e) const {
  std::vector<Expr> inside = leaves({&e, 1});
  std::erase_if(inside,
                [&](Expr leaf) { return known_.count(leaf) > 0 || symbol_of(leaf).kind == Kind::constant; });
  return inside;
}

/// The modes of other borders that stay on one side all along this one, as x = 3 does along x = 2.
Substitution BorderSmoothness::settled_modes(std::size_t border) const {
  constexpr std::size_t enough = 3;  // points that agree
  constexpr double same = 1e-9;      // of sizes near 1, at points on the border that are exact to 2 ε
  std::vector<std::size_t> others;
  std::vector<Expr> functions;
  const auto& own = leaves_of_[border];
  const auto by_id = [](Expr a, Expr b) { return a.id() < b.id(); };
  for (std::size_t k = 0; k < surfaces_.size(); ++k)
    if (k != border && !surfaces_[k].modes.empty() && !leaves_of_[k].empty() &&
        std::includes(own.begin(), own.end(), leaves_of_[k].begin(), leaves_of_[k].end(), by_id)) {
      others.push_back(k);
      functions.push_back(whens_[k]);
    }
  const std::vector<Solvable> solvable = solvable_leaves(whens_[border]);
  Substitution settled;
  if (others.empty() || solvable.empty()) return settled;
  std::mt19937 random(1);
  std::vector<std::vector<double>> seen;
  for (int k = 0; k < attempts && seen.size() < enough; ++k) {
    const Solvable& in = solvable[random() % solvable.size()];
    Values values = random_values(own, random);
    if (move_onto_border(whens_[border], in, values)) seen.push_back(evaluate(functions, values));
  }
  if (seen.size() < enough) return settled;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const double first = seen[0][i];
    if (!std::isfinite(first) || first == 0 || std::any_of(seen.begin(), seen.end(), [&](const auto& values) {
          return !(std::fabs(values[i] - first) <= same * std::fabs(first));
        }))
      continue;
    for (const Mode& mode : surfaces_[others[i]].modes)
      settled[modes_[mode.number]] = Expr(mode.value(first > 0 ? 1 : -1));
  }
  return settled;
}

BorderSmoothness::Difference BorderSmoothness::difference(std::size_t border) const {
  Substitution above = settled_modes(border), below = above;
  std::vector<std::size_t> rows;
  for (const Mode& mode : surfaces_[border].modes) {
    const Expr leaf = modes_[mode.number];
    above[leaf] = Expr(mode.value(1));
    below[leaf] = Expr(mode.value(-1));
    if (const auto at = rows_of_.find(leaf); at != rows_of_.end())
      rows.insert(rows.end(), at->second.begin(), at->second.end());
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  Difference result;
  for (std::size_t row : rows)
    for (Expr D : differences(substitute(equations_[row], above), substitute(equations_[row], below)))
      result.outputs.push_back(D);
  result.parts = result.outputs.size();
  std::vector<Expr> slopes;
  for (std::size_t part = 0; part < result.parts; ++part) {
    const Expr D = result.outputs[part];
    std::vector<Expr> inside = open_leaves(D);
    std::erase_if(inside, [&](Expr leaf) { return kind_.count(leaf) > 0; });
    const std::vector<Expr> gradient_of_D = gradient(D, inside);
    result.starts.push_back(result.parts + slopes.size());
    slopes.insert(slopes.end(), gradient_of_D.begin(), gradient_of_D.end());
  }
  result.outputs.insert(result.outputs.end(), slopes.begin(), slopes.end());
  result.starts.push_back(result.outputs.size());
  return result;
}

BorderSmoothness::Values BorderSmoothness::random_values(const std::vector<Expr>& inside,
                                                         std::mt19937& random) const {
  std::uniform_real_distribution<double> size(0.3, 2);
  std::bernoulli_distribution coin;
  Values values = known_;
  for (Expr leaf : inside) {
    if (values.count(leaf) || symbol_of(leaf).kind == Kind::constant) continue;
    const double sign = coin(random) ? 1 : -1;
    const auto mode = kind_.find(leaf);
    const bool comparison = mode != kind_.end() && mode->second != Mode::Kind::sign;
    values[leaf] = comparison ? (sign + 1) / 2 : mode != kind_.end() ? sign : sign * size(random);
  }
  return values;
}

/// Newton's method in one leaf.
bool BorderSmoothness::move_onto_border(Expr when, const Solvable& in, Values& values) {
  const std::vector<Expr> both{when, in.slope};
  double& y = values[in.leaf];
  for (int k = 0; k < 30; ++k) {
    const std::vector<double> at = evaluate(both, values);
    if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || at[1] == 0) return false;
    const double correction = at[0] / at[1];
    y -= correction;
    constexpr double last_digits = 4e-16;  // 2 ε
    if (std::fabs(correction) <= last_digits * std::fabs(y)) return true;
  }
  return false;
}

std::vector<BorderSmoothness::Solvable> BorderSmoothness::solvable_leaves(Expr when) const {
  std::vector<Solvable> result;
  for (Expr leaf : open_leaves(when))
    if (!kind_.count(leaf)) result.push_back({leaf, partial(when, leaf)});
  return result;
}

std::vector<char> BorderSmoothness::are_positive_around(std::size_t border,
                                                        const std::vector<Expr>& functions) const {
  constexpr double share = 0.1;  // of the leaf that is moved; of 1 where that is 0
  const Expr when = whens_[border];
  const std::vector<Mode>& own = surfaces_[border].modes;
  std::vector<char> result(functions.size(), 0);
  std::vector<Expr> all = functions;
  all.push_back(when);
  const std::vector<Expr> inside = leaves(all);
  const std::vector<Solvable> solvable = solvable_leaves(when);
  if (inside.size() > most_leaves || solvable.empty()) return result;
  std::mt19937 random(1);  // the same points in every run
  std::vector<int> seen(functions.size(), 0), far = seen;
  for (int k = 0; k < attempts; ++k) {
    const Solvable& in = solvable[random() % solvable.size()];
    Values values = random_values(inside, random);
    if (!move_onto_border(when, in, values)) continue;
    const double place = values[in.leaf];
    const double away = place == 0 ? aside : share * std::fabs(place);
    for (const double side : {1.0, -1.0}) {
      for (const Mode& mode : own) values[modes_[mode.number]] = mode.value(side);
      const auto at = [&](double y) {
        values[in.leaf] = y;
        return evaluate(functions, values);
      };
      const std::vector<double> on = at(place), above = at(place + away), below = at(place - away);
      for (std::size_t i = 0; i < functions.size(); ++i) {
        if (!(on[i] > 0)) continue;
        ++seen[i];
        far[i] += std::max(std::fabs(above[i] - on[i]), std::fabs(below[i] - on[i])) < on[i];
      }
    }
  }
  for (std::size_t i = 0; i < functions.size(); ++i) result[i] = seen[i] >= points && 2 * far[i] > seen[i];
  return result;
}

Smoothness BorderSmoothness::operator()(std::size_t border) const {
  const Expr when = whens_[border];
  const Difference difference_of = difference(border);
  std::vector<Expr> all = difference_of.outputs;
  all.push_back(when);
  const std::vector<Expr> inside = leaves(all);
  if (inside.size() > most_leaves) return Smoothness::open;
  const std::vector<Solvable> solvable = solvable_leaves(when);
  if (solvable.empty()) return Smoothness::open;
  std::mt19937 random(1);  // fixed seed: the same points in every run
  Smoothness result = Smoothness::smooth;
  std::vector<int> seen(difference_of.parts, 0);
  const auto enough = [&] {
    return std::all_of(seen.begin(), seen.end(), [](int n) { return n >= points; });
  };
  Values before;
  for (int k = 0; k < attempts && !enough(); ++k) {
    const Solvable& in = solvable[random() % solvable.size()];
    Values values = random_values(inside, random);
    if (k % 2 == 1)  // alternate the sides of other branches: a nested branch acts on one of them only
      for (const auto& [mode, kind] : kind_)
        if (const auto at = values.find(mode); at != values.end())
          at->second = (kind == Mode::Kind::sign ? 0 : 1) - before.at(mode);
    before = values;
    if (!move_onto_border(when, in, values)) continue;
    const double place = values[in.leaf];
    const std::vector<double> on = evaluate(difference_of.outputs, values);
    values[in.leaf] = place + aside;
    const std::vector<double> above = evaluate(difference_of.outputs, values);
    values[in.leaf] = place - aside;
    const std::vector<double> below = evaluate(difference_of.outputs, values);
    const auto vanishes = [&](std::size_t first, std::size_t last) {
      double beside = 0;
      for (double size : {largest(above, first, last), largest(below, first, last)})
        if (std::isfinite(size)) beside = std::max(beside, size);
      return largest(on, first, last) <= zero * beside;
    };
    for (std::size_t part = 0; part < difference_of.parts; ++part) {
      if (!std::isfinite(on[part])) continue;  // outside the domain of the branch
      ++seen[part];
      if (!vanishes(part, part + 1)) return Smoothness::open;
      if (!vanishes(difference_of.starts[part], difference_of.starts[part + 1])) result = Smoothness::kink;
    }
  }
  return enough() ? result : Smoothness::open;
}

}  // namespace pendula::integrate
