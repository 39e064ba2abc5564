// Decides whether an expression is identically zero: by residues and, for functions that these do not
// represent, by values in double precision with bounds on their rounding errors.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "base/error.hpp"
#include "expr/generic/generic.hpp"
#include "expr/generic/random_point.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::generic {
namespace {

constexpr double unit = 1.2e-16;       // of rounding: 2⁻⁵³ = 1.11e-16, rounded up
constexpr double solve_error = 1e-12;  // relative; small systems at points where they are not singular

/// A value with a bound on its rounding error (running error analysis: Higham, Accuracy and Stability of
/// Numerical Algorithms, 2nd ed., §3.3).
struct Real {
  double value = 0, error = 0;
  /// The bound is of first order, and library functions round less accurately than arithmetic;
  /// hence the factor.
  bool is_zero() const { return std::fabs(value) <= 16 * error; }
};

/// Is the result outside the range of doubles? exp(-800) and 1/cosh(800) are not 0.
bool is_out_of_range(Op op, double value, const std::array<Real, 3>& x, int arity) {
  if (std::fabs(value) >= std::numeric_limits<double>::min()) return false;
  if (op != Op::exp && op != Op::mul && op != Op::div && op != Op::pow) return false;
  return std::all_of(x.begin(), x.begin() + arity,
                     [&](const Real& r) { return r.value != 0 || op == Op::exp; });
}

/// An operation with its rounding error and the errors of its operands times the slopes; NaN outside the
/// range of doubles.
Real operation(Op op, const std::array<Real, 3>& x, int arity) {
  const double value = apply(op, x[0].value, x[1].value, x[2].value);
  if (is_out_of_range(op, value, x, arity)) return {std::numeric_limits<double>::quiet_NaN(), 0};
  double error = unit * std::fabs(value);
  for (int i = 0; i < arity; ++i) {
    if (x[i].error == 0) continue;
    std::array<double, 3> moved = {x[0].value, x[1].value, x[2].value};
    // a one-sided difference over √ε of the operand would be best; library functions err by some ε
    constexpr double step = 1e-7, least = 1e-3;  // operands are about 1; near 0 the step is 10⁻¹⁰
    const double h = std::max(x[i].error, step * std::max(std::fabs(moved[i]), least));
    moved[i] += h;
    const double slope = (apply(op, moved[0], moved[1], moved[2]) - value) / h;
    if (std::isfinite(slope)) error += std::fabs(slope) * x[i].error;
  }
  return {value, error};
}

Real real_at(Expr e, std::uint64_t seed) {
  static NodeMap<Real> values;
  values.clear();
  std::unordered_map<Expr, std::vector<double>> solutions;
  for (Expr node : topological({&e, 1})) {
    if (node.is_constant() || (node.is_symbol() && symbol_of(node).kind == Kind::constant)) {
      const double value = constant_value(node.is_constant() ? node : *symbol_of(node).value);
      values[node] = {value, unit * std::fabs(value)};
    } else if (node.is_symbol() || node.op() == Op::call || node.op() >= end_op) {
      // first around 1, where roots and logarithms are defined; every other point lies in (-1, 1)
      const double u = static_cast<double>(random_bits(seed, node) >> 11) * 0x1p-53;
      values[node] = {seed % 2 == 0 ? 0.5 + u : 2 * u - 1, 0};
    } else if (node.op() == Op::solve) {
      if (component_of(node) == 0)
        solutions[node] = solution_value(node, [](Expr operand) { return values[operand].value; });
      const double value = solutions[head_of(node)][component_of(node)];
      values[node] = {value, solve_error * std::fabs(value)};
    } else {
      std::array<Real, 3> x;
      const auto operands = node.operands();
      for (std::size_t i = 0; i < operands.size(); ++i) x[i] = values[operands[i]];
      values[node] = operation(node.op(), x, static_cast<int>(operands.size()));
    }
  }
  return values[e];
}

/// Is e a number, with roots, π or functions of numbers in it?
bool is_number(Expr e) {
  for (Expr node : topological({&e, 1}))
    if (node.op() == Op::call || (node.is_symbol() && symbol_of(node).kind != Kind::constant)) return false;
  return true;
}

/// Does e contain functions of which residues() does not represent all identities?
bool has_other_functions(Expr e) {
  for (Expr node : topological({&e, 1}))
    if (node.op() > Op::pow && node.op() != Op::sin && node.op() != Op::cos && node.op() != Op::exp)
      return true;
  return false;
}

}  // namespace

bool is_zero(Expr e) {
  if (e.is_constant()) return constant_value(e) == 0;
  if (residues({&e, 1})[0].is_zero()) return true;
  if (!has_other_functions(e) && !is_number(e)) return false;
  int finite = 0;
  for (std::uint64_t seed = 2; seed < 2 + attempts && finite < 4; ++seed) {
    const Real r = real_at(e, seed);
    if (!std::isfinite(r.value)) continue;
    ++finite;
    if (!r.is_zero()) return false;
  }
  return finite > 0;
}

}  // namespace pendula::generic
