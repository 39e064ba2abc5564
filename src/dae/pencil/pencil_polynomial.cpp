#include "dae/pencil/pencil_polynomial.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t most = 12;  // rows; the determinant is symbolic

/// A constant coefficient, simplified. Long slopes that vary are detected in linear time by random numbers.
Expr constant_coefficient(const Model& m, std::size_t row, Expr leaf) {
  constexpr std::size_t long_slope = 200;  // nodes
  Expr slope = partial(m.residuals[row], leaf);
  const bool is_long = topological({&slope, 1}).size() > long_slope;
  if (!is_long) slope = simplify(slope);
  for (Expr inside : leaves({&slope, 1})) {
    const Kind kind = symbol_of(inside).kind;
    if (kind == Kind::parameter || kind == Kind::constant) continue;
    if (is_long && generic::is_zero(partial(slope, inside))) continue;
    throw Error(text("equation ", m.label(row), " '", m.equation_text(row),
                     "' has no constant coefficients: that of ", to_text(leaf), " is ", truncated_text(slope),
                     "; sys:linearize(at) makes a linear model at a point"));
  }
  return is_long ? simplify(slope) : slope;
}

}  // namespace

std::vector<Expr> pencil_polynomial(const Model& m) {
  const std::size_t n = m.residuals.size();
  if (n != m.variables.size() || n > most)
    throw Error(text("a characteristic polynomial needs as many equations as unknowns, at most ", most,
                     "; the model has ", n, " and ", m.variables.size()));
  const Expr s = symbol(Kind::slot, "s");
  const auto size = static_cast<Eigen::Index>(n);
  MatX P = MatX::Zero(size, size);
  int degree = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const Expr variable = m.variables[j].leaf;
    int highest = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (Expr leaf : leaves({&m.residuals[i], 1})) {
        if (symbol_of(leaf).base != variable && leaf != variable) continue;
        const Expr slope = constant_coefficient(m, i, leaf);
        const int order = symbol_of(leaf).order;
        highest = std::max(highest, order);
        P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) += slope * pow(s, Expr(order));
      }
    degree += highest;
  }
  Expr rest = expand(linalg::determinant(P));
  std::vector<Expr> coefficients;
  for (int k = 0; k <= degree; ++k) {  // cₖ = det⁽ᵏ⁾(0)/k!
    coefficients.push_back(simplify(substitute(rest, {{s, Expr(0)}})));
    rest = expand(partial(rest, s) / Expr(k + 1));
  }
  while (!coefficients.empty() && coefficients.back().is_zero()) coefficients.pop_back();
  return coefficients;
}

}  // namespace pendula::dae
