#include "dae/newton/lifted_newton.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "dae/newton/least_step.hpp"
#include "expr/rewrite/scaled_exponentials.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// Nodes that grow exponentially in one of the unknowns, operands before operations.
std::vector<Expr> exponentials(std::span<const Expr> equations, std::span<const Expr> unknowns) {
  std::unordered_set<Expr> moving(unknowns.begin(), unknowns.end());
  std::vector<Expr> result;
  for (Expr e : topological(equations)) {
    bool moves = moving.count(e) > 0;
    for (Expr operand : e.operands()) moves = moves || moving.count(operand) > 0;
    if (!moves) continue;
    moving.insert(e);
    const bool power = e.op() == Op::pow && e.operand(0).is_constant() && constant_value(e.operand(0)) > 0;
    if (power || e.op() == Op::exp || e.op() == Op::sinh || e.op() == Op::cosh) result.push_back(e);
  }
  return result;
}

/// Updates an exponent s. Where s grows beyond 0, the new exp(s) is the value of the tangent.
double moved(double s, double step, bool both_ways) {
  if (both_ways && s + step < 0) return -moved(-s, -step, false);
  const double to = s + step, from = std::max(s, 0.0);
  return to <= from ? to : from + std::log1p(to - from);
}

}  // namespace

LiftedNewton::LiftedNewton(std::span<const Expr> equations, std::span<const Expr> unknowns,
                           std::span<const Expr> given) {
  Substitution lifted;
  std::vector<Expr> leaves(unknowns.begin(), unknowns.end()), symbols, exponents;
  for (Expr e : exponentials(equations, unknowns)) {
    const bool power = e.op() == Op::pow;
    const Expr s = symbol(Kind::slot, text("exponent_", symbols.size() + 1));
    symbols.push_back(s);
    exponents.push_back(power ? e.operand(1) * log(e.operand(0)) : e.operand(0));
    both_ways_.push_back(e.op() == Op::sinh || e.op() == Op::cosh);
    lifted.emplace(e, power ? exp(s) : make(e.op(), s));
  }
  if (!applies()) return;
  leaves.insert(leaves.end(), given.begin(), given.end());
  exponents_.emplace(exponents, leaves);
  std::vector<Expr> rows = substitute(equations, lifted);
  const std::vector<Expr> lifted_exponents = substitute(exponents, lifted);
  for (std::size_t k = 0; k < symbols.size(); ++k) rows.push_back(symbols[k] - lifted_exponents[k]);
  leaves.insert(leaves.begin() + static_cast<std::ptrdiff_t>(unknowns.size()), symbols.begin(),
                symbols.end());
  compile(std::move(rows), std::move(leaves), unknowns.size() + symbols.size());
}

void LiftedNewton::compile(std::vector<Expr> rows, std::vector<Expr> leaves, std::size_t unknowns) {
  jacobian_ = sparse_jacobian(rows, {leaves.data(), unknowns});
  std::vector<Expr> slopes;
  for (const Entry& entry : jacobian_) slopes.push_back(entry.value);
  values_.emplace(with_scaled_exponentials(rows), leaves);
  slopes_.emplace(with_scaled_exponentials(slopes), leaves);
}

/// Exponents at w, but at most 0: where an exponential starts above 1, Newton's iteration is slow.
Vec LiftedNewton::first_exponents(const Vec& w, std::span<const double> given) const {
  std::vector<double> at(w.begin(), w.end());
  at.insert(at.end(), given.begin(), given.end());
  const std::vector<double> value = (*exponents_)(at);
  Vec s(static_cast<Index>(value.size()));
  for (std::size_t k = 0; k < value.size(); ++k)
    s[k] = value[k] < 0 && !both_ways_[k] && std::isfinite(value[k]) ? value[k] : 0;
  return s;
}

std::optional<Vec> LiftedNewton::operator()(const Vec& w, std::span<const double> given,
                                            const Vec& unit) const {
  constexpr int most_steps = 200;  // an exponent that moves by 1 a step goes from e²⁰⁰ to 1
  // of a step relative to 1 + |unknown|. Below `small` a Newton step is about the square of the one before;
  // one of more than half of it is rounding.
  constexpr double small = 1e-6, rounding = 1e-14;  // rounding: 45 ε
  const Index own = w.size(), size = own + static_cast<Index>(both_ways_.size());
  Vec at(size), units = Vec::Ones(size);
  at << w, first_exponents(w, given);
  units.head(own) = unit;
  double before = INFINITY;
  for (int k = 0; k < most_steps; ++k) {
    poll_interrupt();
    std::vector<double> leaves(at.begin(), at.end());
    leaves.insert(leaves.end(), given.begin(), given.end());
    const std::vector<double> value = (*values_)(leaves), slope = (*slopes_)(leaves);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t e = 0; e < slope.size(); ++e)
      entries.emplace_back(jacobian_[e].row, jacobian_[e].column, slope[e] * units[jacobian_[e].column]);
    Eigen::SparseMatrix<double> J(static_cast<Index>(value.size()), size);
    J.setFromTriplets(entries.begin(), entries.end());
    const Eigen::Map<const Vec> r(value.data(), static_cast<Index>(value.size()));
    if (!r.allFinite() || !all_finite(J)) return {};
    const Vec weight = row_weights(J);
    const Vec step = least_step(weight.asDiagonal() * J, weight.cwiseProduct(r));
    if (!step.allFinite()) return {};
    const double now =
        step.cwiseQuotient(Vec::Ones(size) + at.cwiseQuotient(units).cwiseAbs()).cwiseAbs().maxCoeff();
    at.head(own) += step.head(own).cwiseProduct(unit);
    Index j = own;
    for (char both_ways : both_ways_) {
      at[j] = moved(at[j], step[j], both_ways != 0);
      ++j;
    }
    if (now <= rounding || (now <= small && now >= before / 2)) return Vec(at.head(own));
    before = now;
  }
  return {};
}

}  // namespace pendula::dae
