#include "dae/model/parameter_values.hpp"

#include <algorithm>

#include "expr/rewrite/vanishing_parts.hpp"

namespace pendula::dae {

std::vector<Expr> at_values(std::span<const Expr> expressions, const ParameterValues& values) {
  const Substitution put(values.begin(), values.end());
  const bool rational = std::all_of(values.begin(), values.end(),
                                    [](const auto& v) { return exact_value(v.second) != nullptr; });
  if (rational) return substitute(expressions, put);
  return substitute(substitute(expressions, vanishing_parts(expressions, values)), put);
}

std::vector<Expr> residuals_at_values(const Model& m) { return at_values(m.residuals, m.values); }

}  // namespace pendula::dae
