#include "dae/rank/stable_values.hpp"

#include <algorithm>
#include <cmath>

#include "dae/rank/rank.hpp"

namespace pendula::dae {

StableValues evaluate_stable(const Evaluator& outputs, const Vec& w, std::span<const double> others,
                             const Vec& unit) {
  constexpr double known_to = 1e-10;  // of w, which is a point with residuals below 1e-11, or exact
  constexpr double clear = 10;        // times the change, as in rank.cpp
  std::vector<double> here(w.begin(), w.end()), moved;
  here.insert(here.end(), others.begin(), others.end());
  moved = here;
  for (std::size_t j = 0; j < static_cast<std::size_t>(w.size()); ++j) {
    const double part = std::fmod((static_cast<double>(j) + 1) * golden_fraction, 1.0);
    const double small = unit.size() ? std::min(unit[j], 1.0) : 1;
    moved[j] += (0.5 + part) * known_to * (std::fabs(here[j]) + 0.01 * small);
  }
  auto values = outputs(here);
  const auto other = outputs(moved);
  std::vector<char> noise(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    noise[k] = std::fabs(values[k]) <= clear * std::fabs(values[k] - other[k]);
  return {std::move(values), std::move(noise)};
}

StableValues evaluate_stable(const std::vector<Expr>& outputs, const std::vector<Expr>& columns, const Vec& w,
                             const std::unordered_map<Expr, double>& known, const Vec& unit) {
  std::vector<Expr> leaves = columns;
  std::vector<double> values;
  for (const auto& [leaf, value] : known) {
    leaves.push_back(leaf);
    values.push_back(value);
  }
  return evaluate_stable(Evaluator(outputs, leaves), w, values, unit);
}

}  // namespace pendula::dae
