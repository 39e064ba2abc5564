// Values of expressions at a point, with cancellation recognised.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "base/math.hpp"
#include "expr/graph/evaluator.hpp"

namespace pendula::dae {

/// Values at w, and which of them are cancellation: as large as their change when w moves by
/// 1e-10 of its size, or of a hundredth of its unit (at most 1; 1 where none is given). Scaling
/// would make numbers of such a 1e-16.
struct StableValues {
  std::vector<double> value;
  std::vector<char> noise;
};
StableValues evaluate_stable(const std::vector<Expr>& outputs, const std::vector<Expr>& columns, const Vec& w,
                             const std::unordered_map<Expr, double>& known, const Vec& unit = {});
/// The same for an evaluator whose leaves are those of w, and then others with these values.
StableValues evaluate_stable(const Evaluator& outputs, const Vec& w, std::span<const double> others,
                             const Vec& unit = {});

}  // namespace pendula::dae
