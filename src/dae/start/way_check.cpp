#include "dae/start/way_check.hpp"

#include <algorithm>
#include <cmath>

namespace pendula::dae {

WayCheck::WayCheck(const Model& model, const NumericArray& numeric)
    : model_(model), numeric_(numeric), scale_(INFINITY) {
  for (const Variable& v : model.variables)
    scale_ = std::min(scale_, unit_of(v.leaf) / unit_of(derivative_leaf(v.leaf)));
}

double WayCheck::unit_of(Expr leaf) const {
  const auto& all = numeric_.columns();
  const auto at = std::find(all.begin(), all.end(), leaf);
  return at == all.end() ? 1 : numeric_.unit()[at - all.begin()];
}

bool WayCheck::holds(const WayOn& way) const {
  const WayExpansion along = expansion(model_, way, true).value_or(straight(way));
  for (std::size_t j = 0; j < along.derivatives.size(); ++j) {
    const auto& [leaf, d] = along.derivatives[j];
    for (std::size_t order = 1; order < d.size(); ++order) {
      const Expr own = derivative_leaf(leaf, static_cast<int>(order));
      if (std::find(way.differs.begin(), way.differs.end(), own) == way.differs.end()) continue;
      const double unit = unit_of(own);
      const auto asked = way.values.find(own);
      const bool moved = asked != way.values.end() &&
                         std::fabs(d[order] - asked->second) > same_derivative * (unit + std::fabs(d[order]));
      if (moved || !is_least(way, along, {j, order}, unit)) return false;
    }
  }
  return true;
}

WayExpansion WayCheck::straight(const WayOn& way) const {
  WayExpansion line{way.values.at(time_symbol()), {}};
  for (const Variable& v : model_.variables) {
    const auto value = way.values.find(v.leaf), slope = way.values.find(derivative_leaf(v.leaf));
    if (value != way.values.end() && slope != way.values.end())
      line.derivatives.push_back({v.leaf, {value->second, slope->second}});
  }
  return line;
}

/// At some distance, between what rounding and what missing derivatives hide.
bool WayCheck::is_least(const WayOn& way, const WayExpansion& along, Place place, double unit) const {
  constexpr double share = 0.3, change = 0.1, least_change = 0.01;
  constexpr double unchanged = 1e-9;
  constexpr int decades = 7;
  const double slope = along.derivatives[place.leaf].second[place.order];
  const double by = change * std::fabs(slope) + least_change * unit;
  double h = 0.1 * scale_;
  for (int k = 0; k < decades; ++k, h /= 10) {
    const Vec here = residuals(way, along, h);
    bool least = true, concerned = false;
    for (double sign : {1.0, -1.0}) {
      WayExpansion other = along;
      other.derivatives[place.leaf].second[place.order] = slope + sign * by;
      const Vec there = residuals(way, other, h);
      for (Eigen::Index i = 0; i < here.size(); ++i) {
        if (std::fabs(there[i] - here[i]) <= unchanged * std::fabs(there[i])) continue;
        concerned = true;
        least = least && std::fabs(here[i]) <= share * std::fabs(there[i]);
      }
    }
    if (concerned && least) return true;
  }
  return false;
}

Vec WayCheck::residuals(const WayOn& way, const WayExpansion& along, double h) const {
  PointValues values = way.values;
  for (const auto& [leaf, value] : along.at(along.t + h)) values[leaf] = value;
  const auto r = evaluate(model_.residuals, values);
  return Eigen::Map<const Vec>(r.data(), static_cast<Eigen::Index>(r.size()));
}

}  // namespace pendula::dae
