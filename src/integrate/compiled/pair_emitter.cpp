#include "integrate/compiled/pair_emitter.hpp"

#include <algorithm>

namespace pendula::integrate {

using codegen::Slot;

PairEmitter::PairEmitter(codegen::Writer& w, const Tableau& rk, Formula h, Slots x, Slots xdot, Slope slope)
    : w_(w),
      rk_(rk),
      h_(h),
      x_(std::move(x)),
      slope_(std::move(slope)),
      K_(static_cast<std::size_t>(rk.stages())) {
  K_[0] = std::move(xdot);
}

std::vector<double> PairEmitter::row(int stage) const {
  std::vector<double> factors;
  for (int j = 0; j < stage; ++j) factors.push_back(rk_.A()(stage, j));
  return factors;
}

const Slots& PairEmitter::slope(int stage) {
  Slots& K = K_[stage];
  if (K.empty()) K = slope_(stage, point(row(stage)));
  return K;
}

/// h Σ factorsⱼ Kⱼ, component k.
Slot PairEmitter::sum(const std::vector<double>& factors, std::size_t k) {
  Slots terms;
  std::vector<double> used;
  for (std::size_t j = 0; j < factors.size(); ++j) {
    if (factors[j] == 0) continue;
    terms.push_back(slope(static_cast<int>(j))[k]);
    used.push_back(factors[j]);
  }
  return (h_ * value(w_.combination(used, terms))).slot(w_);
}

const Slots& PairEmitter::point(std::vector<double> factors) {
  while (!factors.empty() && factors.back() == 0) factors.pop_back();
  for (const Known& known : points_)  // the last stage of a "first same as last" method is the end
    if (known.factors == factors) return known.x;
  for (std::size_t j = 0; j < factors.size(); ++j)
    if (factors[j] != 0) slope(static_cast<int>(j));
  Slots x;
  for (std::size_t k = 0; k < x_.size(); ++k) x.push_back((value(x_[k]) + value(sum(factors, k))).slot(w_));
  points_.push_back({std::move(factors), std::move(x)});
  return points_.back().x;
}

Slots PairEmitter::weights(const Slots& rtol, const Slots& atol) {
  const Slots x1 = end();
  Slots list;
  for (std::size_t k = 0; k < x_.size(); ++k) {
    const Formula size = greater(magnitude(value(x_[k])), magnitude(value(x1[k])));
    list.push_back((1 / (value(atol[k]) + value(rtol[k]) * size)).slot(w_));
  }
  return list;
}

Slots PairEmitter::error(const std::optional<Vec>& embedded, const Slots& weight) {
  if (!embedded) return Slots(x_.size(), w_.constant(0));
  std::vector<double> factors;
  for (Eigen::Index j = 0; j < rk_.stages(); ++j) factors.push_back(rk_.b()[j] - (*embedded)[j]);
  Slots list;
  for (std::size_t k = 0; k < x_.size(); ++k)
    list.push_back((value(sum(factors, k)) * value(weight[k])).slot(w_));
  return list;
}

Slots PairEmitter::squares(const Slots& list) {
  Slots result;
  for (Slot v : list) result.push_back((value(v) * value(v)).slot(w_));
  return result;
}

PairEmitter::Differences PairEmitter::differences(int g, const Slots& xdot, const Slots& weight) {
  const Slots K = slope(g), x1 = end(), at = point(row(g));
  Slots slopes, points;
  for (std::size_t k = 0; k < x_.size(); ++k) {
    slopes.push_back(((value(xdot[k]) - value(K[k])) * value(weight[k])).slot(w_));
    points.push_back(((value(x1[k]) - value(at[k])) * value(weight[k])).slot(w_));
  }
  return {w_.sum(squares(slopes)), w_.sum(squares(points))};
}

}  // namespace pendula::integrate
